"""Quantities of a recording, their SI and display units, and displacements of the muscle end as contractions."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from ..core import Hint, HintedText, chosen_scale

MOVED = ("contraction", "length", "shortening", "position")
"""Columns of the motion of the muscle end; the first one of a recording is used."""
PROPOSALS = ("weg", "hub", "stroke", "travel", "extension", "displacement", "verschiebung", "traverse", "crosshead")
"""Beginnings of headings of displacements, whose zero and direction the heading does not state."""

ZERO_NOT_STATED = HintedText(
    "A displacement has no stated zero and direction.",
    Hint(
        "If it is the shortening from the resting length",
        "columns",
        {"displacement": "shortening [mm]"},
        "ColumnMapping",
    ),
    Hint("If it is the elongation", "columns", {"displacement": "elongation [mm]"}, "ColumnMapping"),
    Hint("To state its reading at the resting length", "displacement_zero", "12 mm", "ColumnMapping"),
)
"""Reason and remedies where a contraction is needed and only a displacement was recorded."""
_DISPLAY_UNITS = {
    "pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "length": (1e3, "mm"), "position": (1e3, "mm"),
    "shortening": (1e3, "mm"),
    "volume": (1e6, "cm³"), "air_mass": (1e3, "g"), "mass_flow": (1e3, "g/s"),
}  # fmt: skip
"""Factor and unit of the quantities that are not displayed in SI units."""


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A measurable quantity: SI unit, symbol and meaning."""

    unit: str
    symbol: str
    meaning: str


QUANTITIES: dict[str, Quantity] = {
    "time": Quantity("s", "t", "time"),
    "pressure": Quantity("Pa", "p", "gauge pressure in the muscle"),
    "contraction": Quantity("1", "eps", "contraction (L0 - L)/L0; negative if the muscle is stretched"),
    "force": Quantity("N", "F", "tensile force of the muscle, positive in tension"),
    "length": Quantity("m", "L", "muscle length between the end fittings"),
    "shortening": Quantity("m", "x", "shortening from the resting length, L0 - L; positive as the muscle contracts"),
    "elongation": Quantity("m", "u", "elongation from the resting length, L - L0; read as a negative shortening"),
    "position": Quantity("m", "y", "displacement of the load, positive as the muscle contracts"),
    "speed": Quantity("m/s", "v", "speed of the load, positive as the muscle contracts"),
    "acceleration": Quantity("m/s^2", "a", "acceleration of the load"),
    "angle": Quantity("rad", "theta", "angle of a joint or lever, positive as its first muscle contracts"),
    "angular_speed": Quantity("rad/s", "omega", "angular speed of the joint or lever"),
    "angular_acceleration": Quantity("rad/s^2", "alpha", "angular acceleration of the joint or lever"),
    "setpoint": Quantity("Pa", "p_set", "set gauge pressure of a regulator"),
    "volume": Quantity("m3", "V", "internal volume of the muscle"),
    "air_mass": Quantity("kg", "m_air", "mass of the air in the muscle"),
    "mass_flow": Quantity("kg/s", "qm", "mass flow into the muscle"),
    "fill": Quantity("1", "u_fill", "opening of the fill valve, from 0 (closed) to 1 (open)"),
    "discharge": Quantity("1", "u_dis", "opening of the discharge valve, from 0 (closed) to 1 (open)"),
    "latched": Quantity("1", "u_latch", "1 while the load is latched, 0 when released"),
    "branch": Quantity("1", "b", "branch stated in the file, 1 inflating, 2 deflating; used for comparison only"),
    "friction": Quantity("N", "F_f", "friction force of the muscle, opposing its motion"),
    "shortening_speed": Quantity("m/s", "v_m", "shortening speed of the contractile element"),
    "bristle": Quantity("m", "z", "deflection of a friction element (bristle)"),
    "stop": Quantity("m", "z_s", "deflection of a stop operator (Prandtl–Ishlinskii)"),
    "torque": Quantity("N m", "Q", "torque of the muscles on a joint, positive in the direction of the angle"),
    "stiffness": Quantity("N m/rad", "K_p", "stiffness of a joint at constant pressure of its muscles"),
    "shut_valves_stiffness": Quantity("N m/rad", "K_m", "stiffness of a joint at constant air mass of its muscles"),
    "cocontraction": Quantity("N m", "Q_c", "part of the torques of two muscles that cancels at a joint"),
    "temperature": Quantity("K", "T", "absolute temperature of the air in the muscle"),
}


def quantity_of(column: str) -> Quantity | None:
    """The quantity of a column: `left.pressure` is a pressure, `bristle2` a bristle; None if it is unknown."""
    return QUANTITIES.get(column.rpartition(".")[2].rstrip("0123456789"))


def display_scale(name: str) -> tuple[float, str]:
    """Factor and unit in which a column is displayed, chosen or usual; the unit is empty for an unknown quantity.

    Raises FileError or UnitError for an invalid configuration file.
    """
    quantity = quantity_of(name)
    if quantity is None:
        return 1.0, ""
    usual = _DISPLAY_UNITS.get(name.rpartition(".")[2], (1.0, "-" if quantity.unit == "1" else quantity.unit))
    if quantity.unit == "1" and usual[1] != "%":  # an opening is not a contraction
        return usual
    factor, unit = chosen_scale(quantity.unit, *usual)
    return factor, "-" if unit == "1" else unit


def displayed(name: str, value: float, digits: int = 4) -> str:
    """A value [SI] of a column as text in the unit in which the column is displayed, such as "5.309 kPa"."""
    factor, unit = display_scale(name)
    return f"{value * factor:.{digits}g} {unit}".removesuffix(" -").rstrip()


def displacement_columns(
    columns: Mapping[str, Any], constants: Mapping[str, float | str]
) -> tuple[dict[str, Any], list[str]]:
    """The columns [SI] with a shortening x = L0 - L for a displacement, or its contraction x/L0; notes on each.

    columns    `shortening` x, or `elongation` u = -x; also `position` y = x if its zero is stated
    constants  displacement_zero: the reading [m] at the resting length, subtracted from each of them (default: 0);
               resting_length L0 [m]

    Without the resting length, the column is `shortening` [m]. A contraction or length in the columns is kept.
    """
    stated = constants.get("displacement_zero")
    zero = float(stated) if isinstance(stated, float | int) else None
    source = next((name for name in ("shortening", "elongation") if name in columns), "")
    if not source and zero is not None and "position" in columns:
        source = "position"
    if not source:
        return dict(columns), []
    sign = -1.0 if source == "elongation" else 1.0
    shortening = sign * (columns[source] - (zero or 0.0))
    kept = {name: values for name, values in columns.items() if name not in ("shortening", "elongation")}
    origin = "the resting length" if zero is None else f"the reading at the resting length, {1e3 * zero:.4g} mm"
    length = constants.get("resting_length")
    if "contraction" in kept or "length" in kept or not isinstance(length, float | int):
        return {**kept, "shortening": shortening}, [f"The {source} counts from {origin}."]
    note = f"The {source} counts from {origin}, and is converted to a contraction with the resting length."
    return {**kept, "contraction": shortening / length}, [note]


def proposal(heading: str) -> str:
    """A sentence that proposes quantities for a heading such as `Weg` or `stroke`; empty for others."""
    if not heading.lower().startswith(PROPOSALS):
        return ""
    return (
        " If it is the displacement of the muscle, map it to 'shortening [mm]' (from the resting length, positive as "
        "the muscle contracts) or to 'elongation [mm]'."
    )
