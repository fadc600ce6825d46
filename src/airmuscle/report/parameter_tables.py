"""Tables of the parameters of models and of the estimates of a fit."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from ..core import Leaf, leaves
from .chapter import BY_ROW, Table, TableColumn

MAX_VALUES = 30
"""Longest list of values that the brief view shows completely (chosen)."""


def parameter_table(model: Any, name: str, title: str, *, brief: bool = False) -> Table:
    """Return a table of all declared parameters of a model: path, symbol, value, unit and
    meaning.
    """
    return leaf_table(((leaf.path, leaf) for leaf in leaves(model)), name, title, brief=brief)


def leaf_table(
    rows: Iterable[tuple[str, Leaf]],
    name: str,
    title: str,
    *,
    bounds: bool = False,
    brief: bool = False,
) -> Table:
    """Return a table of parameters under the given paths; the brief view has all but the middle of
    long lists.
    """
    listed = list(rows)
    paths = [path for path, _ in listed]
    declared = [leaf.declared for _, leaf in listed]
    columns: dict[str, Any] = {
        "parameter": paths,
        "symbol": [field.symbol for field in declared],
        "value": TableColumn([leaf.value for _, leaf in listed], BY_ROW),
        "unit": [field.unit for field in declared],
        "meaning": [field.meaning for field in declared],
    }
    if bounds:
        finite = [_finite_bounds(field.bounds) for field in declared]
        columns["bounds"] = TableColumn(finite, BY_ROW, digits=6)
        columns["fitted"] = TableColumn([field.fitted for field in declared], brief=False)
    return Table(name, title, columns, brief=ends_of_lists(paths) if brief else 0)


def _finite_bounds(bounds: tuple[float, float]) -> tuple[float, float] | None:
    return bounds if any(map(math.isfinite, bounds)) else None


def ends_of_lists(paths: Sequence[str]) -> list[int]:
    """The rows of all parameters, without the middle of long lists."""
    stems = [path.partition("[")[0] for path in paths]
    rows = []
    for row, stem in enumerate(stems):
        count = stems.count(stem)
        place_in_list = row - stems.index(stem)
        if count <= MAX_VALUES or place_in_list in (0, 1, count - 1):
            rows.append(row)
    return rows


def estimate_table(estimates: Sequence[Any], name: str, title: str, *, brief: int = 0) -> Table:
    """Return a table of the estimates of a fit with their standard errors; a parameter on a bound
    has none.

    Each estimate has `name`, `label`, `value`, `stderr`, `unit`, `meaning` and `on_bound`.
    """
    bound = ["on bound" if estimate.on_bound else "" for estimate in estimates]
    errors = [
        None if estimate.on_bound or not math.isfinite(estimate.stderr) else estimate.stderr
        for estimate in estimates
    ]
    columns = {
        "parameter": [estimate.name for estimate in estimates],
        "symbol": [estimate.label for estimate in estimates],
        "value": TableColumn([estimate.value for estimate in estimates], BY_ROW),
        "standard error": TableColumn(errors, BY_ROW, digits=3),
        "unit": [estimate.unit for estimate in estimates],
        **({"remark": bound} if any(bound) else {}),
        "meaning": TableColumn([estimate.meaning for estimate in estimates], brief=False),
    }
    return Table(name, title, columns, brief=brief)
