"""Quantities of a recording, the SI unit in which each is stored, and the unit in which it is displayed."""

from __future__ import annotations

import dataclasses

from ..core.display import chosen_scale

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
