"""Friction: hysteresis models of the force that opposes the motion of a muscle."""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
