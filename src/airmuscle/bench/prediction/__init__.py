"""Prediction of further records by an identified model, and baselines to judge it by."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
