"""Entry point of `python -m airmuscle`."""

from .cli import main

main()
