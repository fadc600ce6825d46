"""Design: bodies, recipes of muscles, parameter studies, sizing, tuning and comparison of
controllers.
"""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
