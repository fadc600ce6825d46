"""Requests: what a user may ask for, declared once for the command line, the page and the files."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
