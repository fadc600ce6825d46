"""Reproduction of three papers, claim by claim."""

from .run import PAPERS, reproduce

__all__ = [
    "PAPERS",
    "reproduce",
]
