"""Hysteresis loops, creep and friction of a muscle or a joint."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
