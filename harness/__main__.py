"""`python -m harness` is the command `crosscheck`."""

from harness.cli import main

main()
