"""Studio: a page in the browser that shows muscles and plants, computed in the page by printed programs."""

from .export_page import export_page
from .law_sheet import law_sheet
from .serve import serve

__all__ = ["export_page", "law_sheet", "serve"]
