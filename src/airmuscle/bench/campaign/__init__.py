"""Identification of one muscle from all records of a bench campaign."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
