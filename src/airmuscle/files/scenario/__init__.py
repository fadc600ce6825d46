"""Scenario files: plants, commands, runs and dynamic fits as TOML.

Readers raise FileError, ParameterError, UnitError, UnknownNameError or ColumnError with the
location.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
