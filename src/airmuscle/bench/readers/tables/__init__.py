"""Tables of arrays as files state them: channels with names, units and rates, before a column is a
quantity.
"""

from ....core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
