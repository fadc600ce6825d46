"""Tables of parameters: of a model, and of the estimates of a fit."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

from ..core import Leaf, leaves
from .chapter import BY_ROW, Table, TableColumn

MAX_VALUES = 30
"""Longest list of values that the brief view shows completely (chosen)."""


class Estimated(Protocol):
    """An estimated parameter of a fit."""

    @property
    def name(self) -> str: ...
    @property
    def label(self) -> str: ...
    @property
    def value(self) -> float: ...
    @property
    def stderr(self) -> float: ...
    @property
    def unit(self) -> str: ...
    @property
    def meaning(self) -> str: ...
    @property
    def on_bound(self) -> bool: ...


def parameter_table(model: Any, name: str, title: str, *, brief: bool = False) -> Table:
    """Return a table of all declared parameters of a model: path, symbol, value, unit and meaning."""
    return leaf_table(((leaf.path, leaf) for leaf in leaves(model)), name, title, brief=brief)


def leaf_table(
    rows: Iterable[tuple[str, Leaf]], name: str, title: str, *, bounds: bool = False, brief: bool = False
) -> Table:
    """Return a table of parameters under the given paths, with their bounds if wanted.

    The brief view has all but the middle of long lists.
    """
    listed = list(rows)
    columns: dict[str, Any] = {
        "parameter": [path for path, _ in listed],
        "symbol": [leaf.declared.symbol for _, leaf in listed],
        "value": TableColumn([leaf.value for _, leaf in listed], BY_ROW),
        "unit": [leaf.declared.unit for _, leaf in listed],
        "meaning": [leaf.declared.meaning for _, leaf in listed],
    }
    if bounds:
        columns["bounds"] = TableColumn([_finite(leaf.declared.bounds) for _, leaf in listed], BY_ROW, digits=6)
        columns["fitted"] = TableColumn([leaf.declared.fitted for _, leaf in listed], brief=False)
    return Table(name, title, columns, brief=_ends_of_lists(columns["parameter"]) if brief else 0)


def estimate_table(estimates: Sequence[Estimated], name: str, title: str, *, brief: int = 0) -> Table:
    """Return a table of the estimates of a fit with their standard errors; a parameter on a bound has none."""
    bound = ["on bound" if each.on_bound else "" for each in estimates]
    errors = [None if each.on_bound or not math.isfinite(each.stderr) else each.stderr for each in estimates]
    columns = {
        "parameter": [each.name for each in estimates],
        "symbol": [each.label for each in estimates],
        "value": TableColumn([each.value for each in estimates], BY_ROW),
        "standard error": TableColumn(errors, BY_ROW, digits=3),
        "unit": [each.unit for each in estimates],
        **({"remark": bound} if any(bound) else {}),
        "meaning": TableColumn([each.meaning for each in estimates], brief=False),
    }
    return Table(name, title, columns, brief=brief)


def _finite(bounds: tuple[float, float]) -> tuple[float, float] | None:
    return bounds if any(map(math.isfinite, bounds)) else None


def _ends_of_lists(paths: Sequence[str]) -> list[int]:
    """The indices of the parameters without the middle of long lists."""
    stems = [path.partition("[")[0] for path in paths]
    return [i for i, stem in enumerate(stems)
            if (count := stems.count(stem)) <= MAX_VALUES or i - stems.index(stem) in (0, 1, count - 1)]  # fmt: skip
