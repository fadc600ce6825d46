"""Control laws and controllers, and what compensates friction, hysteresis, dead zones and
delays.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
