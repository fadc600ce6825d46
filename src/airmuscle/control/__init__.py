"""Control: control laws, their compensators, state estimation and predictive controllers."""

from .. import _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
