"""Outlets: command line, page in the browser, exports in other languages, learning environments."""

from .. import _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
