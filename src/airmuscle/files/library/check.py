"""Checks of an entry: published values that it must reproduce."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ...core import ABSOLUTE, check_field_types, parameter
from ...core.errors import ParameterError, check_known

CHECK_UNITS = {
    "pressure": "Pa",
    "contraction": "1",
    "force": "N",
    "upstream": "Pa",
    "downstream": "Pa",
}
"""Conditions of a check with their unit; the last two are absolute pressures."""
CONDITIONS = {
    "pressure": ("Pa", ("contraction", "force")),
    "contraction": ("1", ("pressure", "force")),
    "force": ("N", ("pressure", "contraction")),
    "volume": ("m3", ("contraction",)),
    "flow": ("m3/s", ("upstream", "downstream")),
}
"""Quantities of a check, each with its unit and the quantities on which it depends; a flow is that
of a valve.
"""


@dataclasses.dataclass(frozen=True)
class Check:
    """Published value that an entry must reproduce within a tolerance: a quantity at given values
    of others, all SI.

    A volume flow is [m3/s at the reference atmosphere] between two absolute pressures [Pa].
    """

    quantity: str
    source: str
    equals: float = parameter("1", "x", "published value")
    tolerance: float = parameter("1", "dx", "permitted deviation")
    pressure: float | None = parameter("Pa", "p", "gauge pressure", default=None)
    contraction: float | None = parameter("1", "eps", "contraction", default=None)
    force: float | None = parameter("N", "F", "force", default=None)
    upstream: float | None = parameter(
        ABSOLUTE, "p_1", "absolute pressure upstream of a valve", default=None
    )
    downstream: float | None = parameter(
        ABSOLUTE, "p_2", "absolute pressure downstream of a valve", default=None
    )

    def __post_init__(self) -> None:
        check_field_types(self)
        _, required = _conditions_of(self.quantity)
        if tuple(name for name, _ in self.conditions) != required:
            raise ParameterError(
                f"a check of the {self.quantity} requires {' and '.join(required)}, and no other."
            )
        for name, value in (
            ("equals", self.equals),
            ("tolerance", self.tolerance),
            *self.conditions,
        ):
            if not math.isfinite(value) or (name == "tolerance" and value < 0.0):
                must = "not be negative" if math.isfinite(value) else "be finite"
                raise ParameterError(f"{name} is {value:g}; it must {must}.")

    @property
    def conditions(self) -> tuple[tuple[str, float], ...]:
        """The quantities on which the checked one depends, with their values."""
        return tuple(
            (name, getattr(self, name)) for name in CHECK_UNITS if getattr(self, name) is not None
        )

    @staticmethod
    def units_of_table(table: Mapping[str, Any]) -> dict[str, str]:
        """The units of the numbers of a table that depend on its quantity."""
        return dict.fromkeys(("equals", "tolerance"), _conditions_of(table.get("quantity"))[0])


def _conditions_of(quantity: Any) -> tuple[str, tuple[str, ...]]:
    """The unit of a checked quantity, and the quantities on which it depends. Raises
    ParameterError.
    """
    check_known("there is no check of the quantity", str(quantity), CONDITIONS)
    return CONDITIONS[quantity]
