"""Plot of a recording over time: one panel for each physical quantity, with set point and
measurement.
"""

import dataclasses
import itertools
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..core import BLACK, DASHES, LINES, Array, chosen_scale, given_axes, legend_outside, new_figure
from .columns import QUANTITIES, display_scale, quantity_of

ROLES = {"setpoint.": "set point", "measured.": "measured", "command.": "command"}
"""Prefixes of the columns of a control loop, and their names in a legend."""
ORDER = (
    "position",
    "angle",
    "pressure",
    "contraction",
    "length",
    "shortening",
    "force",
    "torque",
    "stiffness",
    "opening",
    "mass_flow",
    "friction",
    "speed",
    "angular_speed",
    "acceleration",
    "angular_acceleration",
    "temperature",
    "volume",
    "air_mass",
)
"""Quantities in the order of their panels; others follow."""
MAX_TITLE_LINE = 16
"""Characters of a line of the title of a panel."""
_OPENINGS = ("fill", "discharge", "exhaust", "opening")
_PRESSURE_SETPOINTS = {"setpoint": "set point", "lagged_setpoint": "lagged set point"}
PANELS_IN_A_COLUMN = 7
"""Maximum number of panels below each other; more are plotted in two columns."""
MAX_LEGEND = 6
"""Maximum number of curves that a legend names one by one; of more it names the colours and the
line styles.
"""
MAX_PULSES = 40
BINS = 150
"""Number of alternations above which the duty cycle is drawn with the envelope, and of its
intervals (chosen).
"""
_SUPERSCRIPTS = {ord("^"): None, ord("2"): "²", ord("3"): "³"}


@dataclasses.dataclass(frozen=True)
class Curve:
    """A column in a panel: its name, its label, its part of the plant, such as 'left', and its role
    in a control loop.

    `role` is empty for a state, an output or an input; `variant` is that of the columns of the part
    in this panel.
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
        """Name of the quantity, or of the column if the panel has a single one; long names are on
        several lines.
        """
        name = self.curves[0].name if len(self.curves) == 1 else self.quantity
        return textwrap.fill(name.replace("_", " "), MAX_TITLE_LINE, break_long_words=False)


def panels_of(names: Iterable[str], units: Mapping[str, str], *, ordered: bool) -> list[Panel]:
    """The panels of columns with these names.

    units    SI units of columns that are no known quantity, by name
    ordered  whether the panels are in the usual order of the quantities; otherwise in that of the
             columns
    """
    groups: dict[tuple[str, str], list[str]] = {}
    known = list(names)
    for name in known:
        groups.setdefault(_quantity_and_unit(name, known, units), []).append(name)
    panels = [
        Panel(quantity, unit, _curves(quantity, columns))
        for (quantity, unit), columns in groups.items()
    ]
    if not ordered:
        return panels
    return sorted(
        panels,
        key=lambda panel: ORDER.index(panel.quantity) if panel.quantity in ORDER else len(ORDER),
    )


def _parts_of(name: str) -> tuple[str, str, str, str]:
    """The prefix of a control loop, the name without it, its part of the plant, and the last part
    of the name.
    """
    prefix = next((prefix for prefix in ROLES if name.startswith(prefix)), "")
    base = name.removeprefix(prefix)
    part, _, tail = base.rpartition(".")
    return prefix, base, part, tail


def _quantity_and_unit(name: str, known: list[str], units: Mapping[str, str]) -> tuple[str, str]:
    _, base, part, tail = _parts_of(name)
    quantity = quantity_of(base)
    unit = units.get(name) or units.get(base, "")
    if tail in _PRESSURE_SETPOINTS and (
        unit == "Pa" or (not unit and f"{part}.pressure".lstrip(".") in known)
    ):
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
    roles = {name: _role(quantity, name) for name in names}
    # curves without a role first: their order determines the variants
    for name in sorted(names, key=lambda name: roles[name] != ""):
        role = roles[name]
        _, _, part, tail = _parts_of(name)
        if not role and tail not in variants:
            variants.append(tail)
        variant = variants.index(tail) if tail in variants else 0
        curves.append(Curve(name, _label(quantity, name, role), part, role, variant))
    return tuple(curves)


def _role(quantity: str, name: str) -> str:
    """The role that the prefix states, or that of the set point of a pressure regulator."""
    prefix, _, _, tail = _parts_of(name)
    role = ROLES.get(prefix, "")
    if not role and quantity == "pressure":
        return _PRESSURE_SETPOINTS.get(tail, "")
    return role


def _label(quantity: str, name: str, role: str) -> str:
    """The label of a curve: role and part, or what else distinguishes the column."""
    _, base, part, tail = _parts_of(name)
    is_opening = quantity == "opening"
    is_distinguished = role or (tail != quantity and is_opening)
    if not part and is_distinguished:
        rest = tail if is_opening else ""
    elif tail == quantity or role in _PRESSURE_SETPOINTS.values():
        rest = part
    else:
        rest = base
    words = [word for word in (role, rest) if word]
    label = " ".join(words) or tail
    return label.replace("_", " ") or name


def plot_columns(
    columns: Mapping[str, Array],
    time: Array | None,
    title: str,
    *,
    ax: Any = None,
    units: Mapping[str, str] | None = None,
    ordered: bool = True,
    limit: int | None = None,
) -> Any:
    """Plot columns (N,) over `time` (N,) [s], or over the row number if there is no time.

    ax       Axes for the panels: one, or a sequence; None makes a figure
    units    SI units of columns that are no known quantity, by name
    ordered  whether the panels are in the usual order of the quantities
    limit    maximum number of panels

    Returns `ax`, or the Matplotlib figure. Raises ParameterError if `ax` contains too few Axes.
    """
    panels = panels_of(columns, units or {}, ordered=ordered)[:limit]
    if ax is not None:
        _draw(panels, columns, time, given_axes(ax, len(panels), f"plot of {title}"))
        return ax
    rows = len(panels) if len(panels) <= PANELS_IN_A_COLUMN else -(-len(panels) // 2)
    sides = 1 if rows == len(panels) else 2
    size = {"width": 6.9 if sides == 1 else 12.0, "height": 0.7 + 1.25 * max(rows, 1)}
    figure, axes = new_figure(max(rows, 1), max(sides, 1), sharex=True, squeeze=False, **size)
    below = list(axes.T.ravel())  # the panels go down the columns
    _draw(panels, columns, time, below)
    for unused in below[max(len(panels), 1) :]:
        unused.remove()
        below[rows - 1].set_xlabel(below[len(panels) - 1].get_xlabel())
    figure.align_ylabels()
    figure.suptitle(textwrap.shorten(title, 110, placeholder=" …"), fontsize=9)
    return figure


def _draw(
    panels: Sequence[Panel], columns: Mapping[str, Array], time: Array | None, axes: Sequence[Any]
) -> None:
    """Draw each panel into its axes; the lowest axes of each column have the label of the
    abscissa.
    """
    parts = dict.fromkeys(curve.part for panel in panels for curve in panel.curves)
    colours = dict(zip(parts, itertools.cycle(LINES), strict=False))
    for panel, axis in zip(panels, axes, strict=False):
        factor, unit = _scale(panel)
        for curve in panel.curves:
            values = columns[curve.name]
            abscissa = time if time is not None else np.arange(1, len(values) + 1)
            style = _style(curve, colours, time is not None)
            if time is not None and is_pulsed(values):
                abscissa, values, low, high = duty_cycle(time, values)
                axis.fill_between(
                    abscissa,
                    low * factor,
                    high * factor,
                    color=style["color"],
                    alpha=0.18,
                    linewidth=0,
                )
            axis.plot(abscissa, values * factor, label=curve.label, **style)
        axis.set_ylabel(
            f"{panel.title}\n[{unit.translate(_SUPERSCRIPTS)}]" if unit else panel.title
        )
        if len(panel.curves) > 1:
            handles = (
                axis.get_lines()[-len(panel.curves) :]
                if len(panel.curves) <= MAX_LEGEND
                else _key(panel, colours)
            )
            legend_outside(axis, handles=handles, fontsize=7, handlelength=1.6, labelspacing=0.25)
        subplot = axis.get_subplotspec()
        if subplot is None or subplot.is_last_row() or axis is axes[len(panels) - 1]:
            axis.set_xlabel("time [s]" if time is not None else "row")


def is_pulsed(values: Array) -> bool:
    """Whether a column is switched on and off more often than a plot resolves."""
    size = np.abs(values) / max(np.abs(values).max(initial=0.0), np.finfo(float).tiny)
    on = size[(size < 0.1) | (size > 0.25)] > 0.2
    return int(np.count_nonzero(np.diff(on))) > MAX_PULSES


def duty_cycle(time: Array, values: Array) -> tuple[Array, Array, Array, Array]:
    """Middle of each of BINS equal intervals of time, and mean over it, minimum and maximum of a
    pulsed column.

    The mean holds each value until the next row, as a pulsed input does; intervals without a row
    are left out.
    """
    edges = np.linspace(time[0], time[-1], BINS + 1)
    integral = np.concatenate(([0.0], np.cumsum(values[:-1] * np.diff(time))))
    means = np.diff(np.interp(edges, time, integral)) / np.diff(edges)
    starts = np.searchsorted(time, edges[:-1])
    filled = np.flatnonzero(np.diff(np.append(starts, len(time))) > 0)
    rows = starts[filled]
    middles = 0.5 * (edges[1:] + edges[:-1])
    return (
        middles[filled],
        means[filled],
        np.minimum.reduceat(values, rows),
        np.maximum.reduceat(values, rows),
    )


def _key(panel: Panel, colours: Mapping[str, str]) -> list[Any]:
    """Handles of a legend of many curves: the colour of each part, and the line style of each kind
    of curve.
    """
    from matplotlib.lines import Line2D

    labels = {c.part: (c.part or "plant").replace("_", " ") for c in panel.curves}
    lines = [Line2D([], [], label=label, color=colours[part]) for part, label in labels.items()]
    styles: dict[str, Any] = {}
    for curve in panel.curves:
        name = curve.role or curve.name.rpartition(".")[2].replace("_", " ")
        styles.setdefault(
            name, Line2D([], [], label=name, **{**_style(curve, colours, True), "color": BLACK})
        )
    return [*lines, *(styles.values() if len(styles) > 1 else ())]


def _scale(panel: Panel) -> tuple[float, str]:
    """Factor and display unit of a panel."""
    factor, unit = display_scale(panel.quantity)
    if unit or not panel.unit:
        return factor, unit
    usual = {"Pa": (1e-3, "kPa"), "1": (1.0, "-")}
    return (
        chosen_scale(panel.unit, *usual.get(panel.unit, (1.0, panel.unit)))
        if panel.unit != "1"
        else usual["1"]
    )


def _style(curve: Curve, colours: Mapping[str, str], has_time: bool) -> dict[str, Any]:
    """Line style: one colour for each part; a set point is dashed, a measurement and a command are
    thin.
    """
    colour = colours[curve.part]
    if not has_time:
        return {"linestyle": "none", "marker": "o", "markersize": 2.5, "color": colour}
    if curve.role == "lagged set point":
        return {"color": colour, "linestyle": ":", "linewidth": 1.0}
    if curve.role == "set point":
        return {
            "color": BLACK if len(colours) == 1 else colour,
            "linestyle": (0, (4, 2)),
            "linewidth": 1.0,
        }
    if curve.role:
        return {
            "color": colour,
            "linewidth": 0.7,
            "alpha": 0.6,
            "linestyle": DASHES[curve.variant % len(DASHES)],
        }
    return {"color": colour, "linestyle": DASHES[curve.variant % len(DASHES)], "linewidth": 1.4}
