"""Runs: problems and their solutions, integrators, open and closed loop, forward sensitivities."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
