"""Design: parameter studies, sizing, tuning of controllers, and the benchmark of controllers."""

from .. import _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
