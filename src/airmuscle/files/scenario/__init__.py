"""Scenario files: plants, commands, runs and dynamic fits as TOML."""

from ... import _attach_stub

__getattr__, __dir__, __all__ = _attach_stub(__name__, __file__)
