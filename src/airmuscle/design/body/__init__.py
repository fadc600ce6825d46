"""Bodies with muscle routes, from MJCF or URDF: lengths, moment arms and torques over all poses,
and faults of routes.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
