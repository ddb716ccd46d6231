"""``python -m flagrs``: the command line."""

from flagrs.cli import main

main()
