"""Static characteristics: relations between gauge pressure, contraction and tension; one class per
paper.
"""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
