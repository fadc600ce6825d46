"""The command line. Heavy modules are imported inside the commands, so that `airmuscle list` starts at once."""

from .app import main

__all__ = [
    "main",
]
