"""Identification of a static law from points: fit with its uncertainty, several lengths, design
of experiments.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
