"""Formats of files: bytes -> tables, each by the table of formats."""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
