"""Quick release, Fig. 4 of the third paper: 30 kg, two initial pressures, valves shut."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from ..control.inputs import Schedule
from ..core.plotting import DASHES, LINES, legend_below, new_figure
from ..recording import Recording
from ..report.chapter import AtLeast, AtMost, Claim, Plot, Table
from ..simulation.integrators import Rodas4
from ..simulation.simulate import simulate
from .hosovsky_plant import FORCE_MAPS, PAPER, UnpublishedParameters, latched_load, plant

RELEASED_AT, DURATION = 0.5, 6.0
SCHEDULE = Schedule({"held": ((0.0, 1.0), (RELEASED_AT, 0.0))})
MAX_DAMPING_DIFFERENCE = 0.30
"""Dampings count as comparable when they differ by at most this fraction of the larger (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Release:
    """One release: its run and what is read off it."""

    pressure: float
    run: Recording
    initial_acceleration: float
    max_contraction: float
    damping_ratio: float
    decay_rate: float


def release(numbers: UnpublishedParameters, pressure: float, data: str = FORCE_MAPS[0]) -> Release:
    """Clamped at zero contraction at a gauge pressure [Pa], valves shut, then let go."""
    system = plant(numbers, latched_load(), data=data)
    run = simulate(
        system, SCHEDULE, duration=DURATION, start=system.state_at(pressure=pressure), method=Rodas4(1e-9), output=1e-3
    )
    free = run["time"] >= RELEASED_AT
    ratio, rate = damping(run["time"][free], run["position"][free], run["speed"][free])
    return Release(pressure, run, float(run["acceleration"][free][0]), float(run["contraction"].max()), ratio, rate)


def damping(time: npt.NDArray[Any], position: npt.NDArray[Any], speed: npt.NDArray[Any]) -> tuple[float, float]:
    """Damping ratio [1] and decay rate [1/s] by the logarithmic decrement of the first three swings.

    A swing is the way from one turning point to the next, so the place of rest need not be known. NaN where the
    motion turns fewer than three times (overdamped).
    """
    turns = np.flatnonzero(np.sign(speed[1:-1]) * np.sign(speed[2:]) < 0) + 1
    if turns.size < 4:
        return float("nan"), float("nan")
    fraction = speed[turns] / (speed[turns] - speed[turns + 1])
    at = time[turns] + fraction * (time[turns + 1] - time[turns])
    step = time[turns + 1] - time[turns]
    reached = position[turns] + 0.5 * speed[turns] * fraction * step
    swings = np.abs(np.diff(reached[:4]))
    half_decrement = float(np.log(swings[0] / swings[2]) / 2)
    ratio = half_decrement / np.hypot(np.pi, half_decrement)
    return float(ratio), half_decrement / float(np.mean(np.diff(at[:4])))


def release_pair(numbers: UnpublishedParameters, data: str = FORCE_MAPS[0]) -> tuple[Release, Release]:
    """Both initial pressures, the lower first."""
    return (
        release(numbers, numbers.low_pressure.value, data),
        release(numbers, numbers.high_pressure.value, data),
    )


def compare_releases(low: Release, high: Release) -> dict[str, float]:
    """The four statements as numbers: two differences that must be positive, two relative differences of damping."""

    def apart(a: float, b: float) -> float:
        return abs(a - b) / max(abs(a), abs(b))

    return {
        "acceleration": high.initial_acceleration - low.initial_acceleration,
        "contraction": (high.max_contraction - low.max_contraction) * 100,
        "relative damping": apart(high.damping_ratio, low.damping_ratio),
        "absolute damping": apart(high.decay_rate, low.decay_rate),
    }


def range_table(numbers: UnpublishedParameters) -> Table:
    """The four statements with every chosen number at both ends of its range, and on the second force map."""
    cases = [("as chosen", numbers, FORCE_MAPS[0]), ("surface fitted to the tool table", numbers, FORCE_MAPS[1])]
    for name, value in numbers.range_ends():
        if name == "load":  # hangs on the muscle in fill and discharge only
            continue
        unit = getattr(numbers, name).unit
        cases.append((f"{name.replace('_', ' ')} {value:g} {unit}", numbers.with_value(name, value), FORCE_MAPS[0]))
    found = [compare_releases(*release_pair(case, data)) for _, case, data in cases]
    columns: dict[str, Any] = {"varied": [name for name, _, _ in cases]}
    for key, unit in (
        ("acceleration", "m/s2"),
        ("contraction", "% of length"),
        ("relative damping", "1"),
        ("absolute damping", "1"),
    ):
        columns[f"{key}, difference [{unit}]"] = [row[key] for row in found]
    note = f"differences of damping relative to the larger; comparable up to {MAX_DAMPING_DIFFERENCE:g} (chosen)"
    return Table("hosovsky_release_ranges", "Quick release over the range of every chosen number", columns, note)


def claims(low: Release, high: Release, ranges: Table) -> tuple[Claim, ...]:
    """The paper's statements on Fig. 4; each note says whether it holds over all chosen ranges."""
    values = compare_releases(low, high)
    columns = list(ranges.columns.values())[1:]
    alike, more = AtMost(MAX_DAMPING_DIFFERENCE, chosen=True), AtLeast(0.0)
    statements = (
        ("a higher initial pressure gives a higher first acceleration: difference", "acceleration", more, "m/s2"),
        ("a higher initial pressure gives a larger greatest contraction: difference", "contraction", more, "%"),
        ("relative damping is comparable in both: difference of the damping ratios", "relative damping", alike, "1"),
        ("absolute damping is comparable in both: difference of the decay rates", "absolute damping", alike, "1"),
    )  # fmt: skip
    found = []
    for (text, key, printed, unit), column in zip(statements, columns, strict=True):
        failing = [n for n, v in zip(ranges.columns["varied"], column, strict=True) if not printed.agrees(v)]
        held = "holds" if not failing else f"fails for {', '.join(failing)}; holds otherwise"
        note = (
            f"{low.pressure / 1e3:g} and {high.pressure / 1e3:g} kPa gauge (chosen); over the range of every chosen "
            f"number {min(column):.3g} to {max(column):.3g} {unit}: {held}"
        )
        found.append(Claim(PAPER, text, printed, values[key], unit, note))
    return tuple(found)


def figure_4(low: Release, high: Release) -> Plot:
    """Contraction and acceleration after the release, as Fig. 4."""
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    for i, one in enumerate((low, high)):
        label = f"{one.pressure / 1e3:g} kPa gauge"
        style = {"color": LINES[i], "linestyle": DASHES[i], "label": label}
        axes[0].plot(one.run["time"] - RELEASED_AT, one.run["contraction"] * 100, **style)
        axes[1].plot(one.run["time"] - RELEASED_AT, one.run["acceleration"], **style)
    axes[0].set_ylabel("contraction [%]")
    axes[1].set(ylabel="acceleration [m/s²]", xlabel="time after the release [s]", xlim=(-0.2, 3.0))
    legend_below(figure, axes[0])
    return Plot(
        "hosovsky_fig4", "Quick release of 30 kg from zero contraction at two initial pressures, as Fig. 4.", figure
    )
