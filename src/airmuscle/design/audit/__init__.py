"""Audit of a muscle law, an orifice or a list of constants of others for what physics forbids."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
