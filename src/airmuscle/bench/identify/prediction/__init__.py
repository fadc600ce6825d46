"""Prediction of further records by an identified law or plant, with the stated 95 % band."""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
