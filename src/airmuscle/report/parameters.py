"""The numbers of a model as a table of a report."""

from __future__ import annotations

from typing import Any

from ..core.tree import leaves
from .chapter import Table


def parameter_table(thing: Any, name: str, title: str) -> Table:
    """Every declared number inside `thing`, with path, symbol, value, unit and meaning."""
    found = list(leaves(thing))
    return Table(
        name,
        title,
        {
            "parameter": [leaf.path for leaf in found],
            "symbol": [leaf.declared.symbol for leaf in found],
            "value (SI)": [leaf.value for leaf in found],
            "unit": ["" if leaf.declared.unit == "1" else leaf.declared.unit for leaf in found],
            "meaning": [leaf.declared.meaning for leaf in found],
        },
    )
