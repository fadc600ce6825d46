"""Foundations: models and parameters, parameter trees, numeric and symbolic operators, errors,
references, units.
"""

from .stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
