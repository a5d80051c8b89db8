"""docs/api.md lists the public names, each once."""

import re

import volref
from tests.docs.pages import DOCS


def test_the_page_lists_every_public_name_once():
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\.\. auto(?:class|function|exception):: (\w+)$", text, re.MULTILINE)
    assert sorted(listed) == sorted(volref.__all__)
