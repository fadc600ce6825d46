"""Reproduction of three papers, claim by claim."""

from .run import PAPERS, chapter_texts, reproduce

__all__ = ["PAPERS", "chapter_texts", "reproduce"]
