"""Rig: planned signals as files, and the player that plays them on a test rig."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
