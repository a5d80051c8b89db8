"""Words that options take, and progress that only a terminal sees."""

import argparse
import io
import sys

import pytest

from volref.cli.options import byte_count, fraction, image_size, nan_policy, statement
from volref.cli.output import note, progress, refuse


class Terminal(io.StringIO):
    def isatty(self):
        return True


def last_line(text):
    """Return what a terminal shows on the line that was written over and over."""
    shown = ""
    for part in text.split("\r"):
        shown = part + shown[len(part) :]
    return shown


@pytest.mark.parametrize(
    ("text", "number"), [("0.5", 0.5), ("1/510", 1 / 510), ("-2", -2.0), ("1e-3/2", 5e-4), (" 3 ", 3.0)]
)
def test_a_number_may_be_a_fraction(text, number):
    assert fraction(text) == number


@pytest.mark.parametrize("text", ["", "x", "1/0", "1/", "/2", "nan", "inf", "1e999", "1/2/3", "0x10"])
def test_other_words_are_no_number(text):
    with pytest.raises(argparse.ArgumentTypeError, match=r"must be a number such as 0\.002 or 1/510"):
        fraction(text)


@pytest.mark.parametrize("text", ["", "640", "640x", "x480", "640x480x3", "-1x2", "6.0x4", "640 480"])
def test_other_words_are_no_size(text):
    with pytest.raises(argparse.ArgumentTypeError, match="WIDTHxHEIGHT"):
        image_size(text)


@pytest.mark.parametrize(("text", "count"), [("0", 0), ("12", 12), ("3k", 3072), ("2T", 2 * 2**40)])
def test_bytes_may_have_a_unit(text, count):
    assert byte_count(text) == count


@pytest.mark.parametrize("text", ["", "M", "1KK", "1.5G", "-1", "1 G", "1X"])
def test_other_words_are_no_byte_count(text):
    with pytest.raises(argparse.ArgumentTypeError, match="number of bytes"):
        byte_count(text)


@pytest.mark.parametrize(
    ("text", "pair"),
    [
        ("a=1", ("a", 1)),
        ("a=1,2", ("a", [1, 2])),
        ("a=[[1,0],[0,1]]", ("a", [[1, 0], [0, 1]])),
        ("a=word", ("a", "word")),
        ("a=NaN", ("a", "NaN")),
        ("a=b=c", ("a", "b=c")),
        ("a=", ("a", [])),
    ],
)
def test_a_statement_is_numbers_where_it_can_be(text, pair):
    assert statement(text) == pair


def test_nan_is_refused_or_replaced_by_a_number():
    assert (nan_policy("refuse"), nan_policy("-1e3")) == ("refuse", -1000.0)


def test_nobody_is_shown_progress_without_a_terminal(capsys):
    with progress("work") as show:
        assert show is None
    assert capsys.readouterr() == ("", "")


def test_quiet_shows_no_progress_on_a_terminal_either(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress("work", quiet=True) as show:
        assert show is None
    assert sys.stderr.getvalue() == ""


def test_tqdm_shows_progress_on_a_terminal(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress("work") as show:
        show(1, 4)
        show(4, 4)
    assert "work" in sys.stderr.getvalue()
    assert last_line(sys.stderr.getvalue()).strip() == ""


def test_one_line_shows_progress_where_tqdm_is_missing_and_is_gone_in_the_end(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setitem(sys.modules, "tqdm", None)
    with progress("work") as show:
        show(9, 10)
        assert last_line(sys.stderr.getvalue()).rstrip() == "work 9/10"
        show(10, 10)
        assert last_line(sys.stderr.getvalue()).rstrip() == "work 10/10"
    assert last_line(sys.stderr.getvalue()).strip() == ""
    assert "\n" not in sys.stderr.getvalue()


def test_the_line_of_progress_is_gone_too_when_the_work_fails(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setitem(sys.modules, "tqdm", None)

    def fail():
        with progress("work") as show:
            show(1, 10)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert last_line(sys.stderr.getvalue()).strip() == ""


def test_a_refusal_is_one_line_whatever_the_message_holds(capsys):
    refuse("a\nb\x1b[31m must\tbe c")
    note("kept as it is")
    assert capsys.readouterr().err == "volref: a b [31m must be c\nvolref: kept as it is\n"
