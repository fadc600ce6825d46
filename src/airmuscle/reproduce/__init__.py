"""The three papers, each reproduced claim by claim in a file of its own, and what runs them."""

from .run import PAPERS, reproduce

__all__ = [
    "PAPERS",
    "reproduce",
]
