"""Outlets: command line, page in the browser, exports in other languages, learning environments."""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
