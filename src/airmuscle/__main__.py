"""`python -m airmuscle` is the command `airmuscle`."""

from .cli import main

main()
