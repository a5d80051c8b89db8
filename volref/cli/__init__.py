"""The command `volref`: one module per verb, parsing and printing only."""

from volref.cli.program import main

__all__ = ["main"]
