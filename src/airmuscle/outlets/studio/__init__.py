"""Studio: a page in the browser that shows muscles and plants, computed in the page by printed
programs.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
