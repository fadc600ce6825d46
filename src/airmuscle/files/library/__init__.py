"""Library: parameter sets of muscles, laws, valves, plants and products as TOML files, with sources
and checks.

Readers raise FileError, ParameterError, UnitError, UnknownNameError or ColumnError with the
location.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
