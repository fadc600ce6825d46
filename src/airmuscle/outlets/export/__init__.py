"""Export of plants, laws and controllers as source text of other languages, as FMUs, and as MuJoCo
plugins.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
