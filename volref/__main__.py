"""`python -m volref` is the command `volref`."""

from volref.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
