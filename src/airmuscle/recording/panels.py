"""Panels of the plot of a recording: one for each physical quantity, its columns with set point and measurement."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Iterable, Mapping

from .columns import QUANTITIES, quantity_of

ROLES = {"setpoint.": "set point", "measured.": "measured", "command.": "command"}
"""Prefixes of the columns of a control loop, and their names in a legend."""
ORDER = (
    "position", "angle", "pressure", "contraction", "length", "shortening", "force", "torque", "stiffness", "opening",
    "mass_flow", "friction", "speed", "angular_speed", "acceleration", "angular_acceleration", "temperature", "volume",
    "air_mass",
)  # fmt: skip
"""Quantities in the order of their panels; others follow."""
MAX_TITLE_LINE = 16
"""Characters of a line of the title of a panel."""
_OPENINGS = ("fill", "discharge", "exhaust", "opening")
_PRESSURE_SETPOINTS = {"setpoint": "set point", "lagged_setpoint": "lagged set point"}


@dataclasses.dataclass(frozen=True)
class Curve:
    """A column in a panel: its name, its label, its part of the plant, such as 'left', and its role in a control loop.

    `role` is empty for a state, an output or an input; `variant` is that of the columns of the part in this panel.
    """

    name: str
    label: str
    part: str
    role: str
    variant: int = 0


@dataclasses.dataclass(frozen=True)
class Panel:
    """The columns of one quantity; `unit` is its SI unit, empty if it is unknown."""

    quantity: str
    unit: str
    curves: tuple[Curve, ...]

    @property
    def title(self) -> str:
        """Name of the quantity, or of the column if the panel has a single one; long names are on several lines."""
        name = self.curves[0].name if len(self.curves) == 1 else self.quantity
        return textwrap.fill(name.replace("_", " "), MAX_TITLE_LINE, break_long_words=False)


def panels_of(names: Iterable[str], units: Mapping[str, str], *, ordered: bool) -> list[Panel]:
    """The panels of columns with these names.

    units    SI units of columns that are no known quantity, by name
    ordered  whether the panels are in the usual order of the quantities; otherwise in that of the columns
    """
    groups: dict[tuple[str, str], list[str]] = {}
    known = list(names)
    for name in known:
        groups.setdefault(_quantity_and_unit(name, known, units), []).append(name)
    panels = [Panel(quantity, unit, _curves(quantity, columns)) for (quantity, unit), columns in groups.items()]
    if not ordered:
        return panels
    return sorted(panels, key=lambda panel: ORDER.index(panel.quantity) if panel.quantity in ORDER else len(ORDER))


def _without_role(name: str) -> tuple[str, str]:
    """The name without the prefix of a control loop, and that prefix."""
    prefix = next((prefix for prefix in ROLES if name.startswith(prefix)), "")
    return name.removeprefix(prefix), prefix


def _quantity_and_unit(name: str, known: list[str], units: Mapping[str, str]) -> tuple[str, str]:
    base, _ = _without_role(name)
    part, _, tail = base.rpartition(".")
    quantity, unit = quantity_of(base), units.get(name) or units.get(base, "")
    if tail in _PRESSURE_SETPOINTS and (unit == "Pa" or (not unit and f"{part}.pressure".lstrip(".") in known)):
        return "pressure", "Pa"
    if tail in _OPENINGS:
        return "opening", "1"
    if quantity is not None:
        stem = tail.rstrip("0123456789")
        return (stem if stem in QUANTITIES else tail), quantity.unit
    return (tail if "." in base else base), unit


def _curves(quantity: str, names: list[str]) -> tuple[Curve, ...]:
    """The curves of a panel; columns of one part have one colour and differ in their variant."""
    curves: list[Curve] = []
    variants: list[str] = []
    for name in sorted(names, key=lambda name: _role_of(name, quantity) != ""):
        base, _ = _without_role(name)
        part, _, tail = base.rpartition(".")
        role = _role_of(name, quantity)
        own = role or (tail != quantity and quantity == "opening")
        variants += [tail] if not role and tail not in variants else []
        rest = part if tail == quantity or role in _PRESSURE_SETPOINTS.values() else base
        if not part and own:
            rest = tail if quantity == "opening" else ""
        variant = variants.index(tail) if tail in variants else 0
        label = " ".join(filter(None, (role, rest))).replace("_", " ") or tail.replace("_", " ")
        curves.append(Curve(name, label or name, part, role, variant))
    return tuple(curves)


def _role_of(name: str, quantity: str) -> str:
    """The role of a column in its panel: that of its prefix, or of the set point of a pressure regulator."""
    base, prefix = _without_role(name)
    tail = base.rpartition(".")[2]
    return ROLES.get(prefix, "") or (_PRESSURE_SETPOINTS.get(tail, "") if quantity == "pressure" else "")
