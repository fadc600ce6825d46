"""Contribution of a muscle by somebody else: its declaration, and the check that accepts it."""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
