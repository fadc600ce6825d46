"""Configuration of Sphinx for the documentation site; run by release/make_book.py on the generated
source folder.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import airmuscle
from book.accessible import set_up_accessibility
from book.mathml import set_up_mathml
from book.search_index import set_up_search

project = "airmuscle"
author = copyright = "The airmuscle developers"
release = version = airmuscle.__version__
extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 4
myst_enable_extensions = ["attrs_inline"]
highlight_language = "text"
smartquotes = False
nitpicky = True
suppress_warnings = ["myst.xref_ambiguous"]
exclude_patterns = ["build"]
html_theme = "furo"
html_title = "airmuscle"
html_copy_source = False
html_show_sphinx = False
html_static_path = [str(Path(__file__).with_name("static"))]
html_css_files = ["book.css"]
html_js_files = ["search.js"]
html_math_renderer = "mathml"
html_theme_options: dict[str, Any] = {
    "light_css_variables": {"color-brand-primary": "#00567f", "color-brand-content": "#00567f"},
    "dark_css_variables": {"color-brand-primary": "#6cb8e6", "color-brand-content": "#6cb8e6"},
    "footer_icons": [],
}
pygments_style = "a11y-light"
pygments_dark_style = "a11y-dark"


def setup(app: Any) -> None:
    """Register the renderer of formulas, the index of the search, and what makes pages
    accessible.
    """
    set_up_mathml(app)
    set_up_search(app)
    set_up_accessibility(app)
