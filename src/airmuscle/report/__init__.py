"""Reports: chapters with claims, tables and figures; HTML, JSON and CSV output."""

from .. import _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
