"""The quantities that a recording knows, with the unit each is kept in."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A measurable quantity: the SI unit it is kept in, its symbol, what it means."""

    unit: str
    symbol: str
    meaning: str


QUANTITIES: dict[str, Quantity] = {
    "time": Quantity("s", "t", "time"),
    "pressure": Quantity("Pa", "p", "gauge pressure in the muscle"),
    "contraction": Quantity("1", "eps", "contraction (L0 - L)/L0; negative when stretched"),
    "force": Quantity("N", "F", "tension of the muscle, pulling positive"),
    "length": Quantity("m", "L", "length between the fittings"),
    "position": Quantity("m", "y", "displacement of the load, positive as the muscle contracts"),
    "speed": Quantity("m/s", "v", "speed of the load, positive as the muscle contracts"),
    "acceleration": Quantity("m/s^2", "a", "acceleration of the load"),
    "angle": Quantity("rad", "theta", "angle of a joint or lever, positive as its first muscle contracts"),
    "angular_speed": Quantity("rad/s", "omega", "speed of that angle"),
    "angular_acceleration": Quantity("rad/s^2", "alpha", "acceleration of that angle"),
    "volume": Quantity("m3", "V", "enclosed volume"),
    "air_mass": Quantity("kg", "m_air", "mass of the air in the muscle"),
    "mass_flow": Quantity("kg/s", "qm", "mass flow into the muscle"),
    "fill": Quantity("1", "u_fill", "opening of the fill valve, 0 shut to 1 open"),
    "discharge": Quantity("1", "u_dis", "opening of the discharge valve, 0 shut to 1 open"),
    "latched": Quantity("1", "u_latch", "1 while the load is latched, 0 released"),
    "branch": Quantity("1", "b", "branch as a file states it, 1 inflating, 2 deflating; it only judges what is found"),
    "friction": Quantity("N", "F_f", "friction of the muscle, against its motion"),
    "bristle": Quantity("m", "z", "deflection of a friction element"),
    "stop": Quantity("m", "z_s", "deflection of a stop operator"),
    "temperature": Quantity("K", "T", "absolute temperature of the air"),
}


def quantity_of(column: str) -> Quantity | None:
    """The quantity behind a column name; `left.pressure` is a pressure, `bristle2` a bristle."""
    return QUANTITIES.get(column.rpartition(".")[2].rstrip("0123456789"))
