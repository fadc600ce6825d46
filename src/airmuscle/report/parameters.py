"""Parameter table of a model."""

from __future__ import annotations

from typing import Any

from ..core.tree import leaves
from .chapter import Table


def parameter_table(model: Any, name: str, title: str) -> Table:
    """Return a table of all declared parameters of a model: path, symbol, value (SI), unit and meaning."""
    parameters = list(leaves(model))
    return Table(
        name,
        title,
        {
            "parameter": [leaf.path for leaf in parameters],
            "symbol": [leaf.declared.symbol for leaf in parameters],
            "value (SI)": [leaf.value for leaf in parameters],
            "unit": ["" if leaf.declared.unit == "1" else leaf.declared.unit for leaf in parameters],
            "meaning": [leaf.declared.meaning for leaf in parameters],
        },
    )
