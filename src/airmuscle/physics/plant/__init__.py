"""Plant: one or more muscles with their pneumatic circuits, a mechanism, a gas and the ambient
air.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
