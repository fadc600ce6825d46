"""Unit factors such as `bar` and `mm` (`6 * bar` is 600 000 Pa), and conversion of text with a unit
("300 mm") to SI.

`display("bar", "mm")` chooses the units of plots, tables and texts.

All internal values are SI. A pressure is gauge unless its unit states absolute, such as "bara" or
"kPa(a)".
"""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
