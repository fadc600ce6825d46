"""Cams: pulleys of variable radius on which a muscle gives a torque over the angle of a joint."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
