"""Studio: a page in the browser that shows muscles and plants, computed in the page by printed programs."""

from .server import serve
from .single_file import export_page

__all__ = ["export_page", "serve"]
