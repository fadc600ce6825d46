"""Diagnoses of data and of fits: values that no muscle explains, support of the data, causes of a
misfit.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
