"""Quick release, Fig. 4 of Hošovský et al.: four claims, with the chosen values varied alone and
together.
"""

import dataclasses
import functools
import itertools
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import airmuscle as am

from ..core import DASHES, LINES, legend_below, new_figure
from ..design.study import Sobol, Uniform
from ..report import AtLeast, AtMost, Claim, Plot, Table
from ..report.claims import ClaimRow
from ..report.formatting import format_quantity, format_unit
from . import hosovsky_plant as rig
from .hosovsky_plant import FORCE_MAPS, UnpublishedParameters, latched_load, plant
from .run import captioned, claim_row, titled

RELEASED_AT = 0.5
RELEASE_DURATION = 6.0
RELEASE_SCHEDULE = am.Schedule({"latched": ((0.0, 1.0), (RELEASED_AT, 0.0))})
MAX_DAMPING_DIFFERENCE = 0.30
"""Maximum relative difference of comparable damping, as a fraction of the larger value (chosen)."""
COMPARABLE = AtMost(MAX_DAMPING_DIFFERENCE, chosen=True)
STATEMENTS = {
    **{
        key: claim_row(rig.PAPER, key, printed=AtLeast(0.0, derived=True))
        for key in ("acceleration", "contraction")
    },
    **{
        key: claim_row(rig.PAPER, key, printed=COMPARABLE)
        for key in ("relative damping", "absolute damping")
    },
}
"""The four statements of the paper on the quick release, each with its criterion."""


def agrees(key: str, value: float) -> bool:
    """Return whether a value confirms a statement."""
    criterion = STATEMENTS[key].blank.printed
    return criterion is not None and criterion.agrees(value)


@dataclasses.dataclass(frozen=True, eq=False)
class Release:
    """One release: the simulation and its characteristic values, SI units."""

    pressure: float
    run: am.Recording
    initial_acceleration: float
    max_contraction: float
    damping_ratio: float
    decay_rate: float


def release(
    parameters: UnpublishedParameters,
    pressure: float,
    data: str = FORCE_MAPS[0],
    duration: float = RELEASE_DURATION,
) -> Release:
    """Simulate the release of a muscle clamped at zero contraction, at a gauge pressure [Pa], with
    closed valves.

    The muscle is released `RELEASED_AT` seconds after the start; `duration` [s] includes that time.
    """
    system = plant(parameters, latched_load(), data=data)
    options: dict[str, Any] = {
        "initial_state": system.state_at(pressure=pressure),
        "output_times": 1e-3,
    }
    run = am.simulate(
        system, RELEASE_SCHEDULE, duration=duration, integrator=am.Rodas4(1e-9), **options
    )
    free = run["time"] >= RELEASED_AT
    ratio, rate = damping(run["time"][free], run["position"][free], run["speed"][free])
    return Release(
        pressure,
        run,
        float(run["acceleration"][free][0]),
        float(run["contraction"].max()),
        ratio,
        rate,
    )


def damping(
    time: npt.NDArray[Any], position: npt.NDArray[Any], speed: npt.NDArray[Any]
) -> tuple[float, float]:
    """Return damping ratio [1] and decay rate [1/s] by the decrement of three half-cycles; NaN if
    overdamped.
    """
    turns = np.flatnonzero(np.sign(speed[1:-1]) * np.sign(speed[2:]) < 0) + 1
    if turns.size < 4:
        return float("nan"), float("nan")
    fraction = speed[turns] / (speed[turns] - speed[turns + 1])
    instants = time[turns] + fraction * (time[turns + 1] - time[turns])
    step = time[turns + 1] - time[turns]
    extremes = position[turns] + 0.5 * speed[turns] * fraction * step
    half_cycles = np.abs(
        np.diff(extremes[:4])
    )  # between turning points: no equilibrium position is needed
    half_decrement = float(np.log(half_cycles[0] / half_cycles[2]) / 2)
    ratio = half_decrement / np.hypot(np.pi, half_decrement)
    return float(ratio), half_decrement / float(np.mean(np.diff(instants[:4])))


def release_pair(
    parameters: UnpublishedParameters, data: str = FORCE_MAPS[0]
) -> tuple[Release, Release]:
    """Simulate the releases from both initial pressures; the lower one first."""
    low, high = (
        release(parameters, each.value, data)
        for each in (parameters.low_pressure, parameters.high_pressure)
    )
    return low, high


def compare_releases(low: Release, high: Release) -> dict[str, float]:
    """Return the four statements as values: two differences that must be positive, two relative
    damping differences.
    """
    dampings = ((high.damping_ratio, low.damping_ratio), (high.decay_rate, low.decay_rate))
    relative, absolute = (abs(a - b) / max(abs(a), abs(b)) for a, b in dampings)
    return {
        "acceleration": high.initial_acceleration - low.initial_acceleration,
        "contraction": (high.max_contraction - low.max_contraction) * 100,
        "relative damping": relative,
        "absolute damping": absolute,
    }


def range_table(parameters: UnpublishedParameters) -> Table:
    """Return the four statements for both ends of the range of every chosen value, and for the
    second force map.
    """
    named = zip(("nominal values", "surface fitted to the tool table"), FORCE_MAPS, strict=True)
    cases = [(name, parameters, data) for name, data in named]
    for name, item in rig.chosen_values(parameters).items():
        if name != "load":  # used during fill and discharge only
            cases += [
                (
                    f"{name.replace('_', ' ')} {end:g} {item.unit}",
                    parameters.with_value(name, end),
                    FORCE_MAPS[0],
                )
                for end in (item.low, item.high)
            ]
    values = [compare_releases(*release_pair(case, data)) for _, case, data in cases]
    columns: dict[str, Any] = {"varied parameter": [name for name, _, _ in cases]}
    for key, unit in zip(STATEMENTS, ("m/s2", "% of length", "1", "1"), strict=True):
        columns[f"{key}, difference [{unit}]"] = [row[key] for row in values]
    note = (
        "Damping differences are relative to the larger value; they are comparable up to "
        f"{MAX_DAMPING_DIFFERENCE:g} (chosen)."
    )
    return Table(
        "hosovsky_release_ranges",
        "Quick release over the ranges of all chosen values",
        columns,
        note,
    )


def claims(low: Release, high: Release, ranges: Table) -> tuple[Claim, ...]:
    """Return the claims on Fig. 4 for the nominal values; the notes give their ranges, each value
    varied alone.
    """
    values = compare_releases(low, high)
    varied = ranges.columns["varied parameter"]
    result = []
    for (key, row), column in zip(
        STATEMENTS.items(), list(ranges.columns.values())[1:], strict=True
    ):
        failing = [
            name for name, value in zip(varied, column, strict=True) if not agrees(key, value)
        ]
        outcome = (
            "it holds"
            if not failing
            else f"it does not hold for {', '.join(failing)}; otherwise it holds"
        )
        note = (
            f"Initial gauge pressures {low.pressure / 1e3:g} and {high.pressure / 1e3:g} kPa"
            f" (chosen). Each chosen value varied alone over its range: {min(column):.3g} to"
            f" {max(column):.3g} {format_unit(row.blank.unit)}"
        )
        result.append(row.claim("nominal values", values[key], f"{note.rstrip()}; {outcome}."))
    return tuple(result)


def figure_4(low: Release, high: Release) -> Plot:
    """Return Fig. 4: contraction and acceleration after the release."""
    figure, axes = new_figure(2, 1, height=4.6, sharex=True)
    for i, released in enumerate((low, high)):
        label = f"{released.pressure / 1e3:g} kPa (gauge)"
        style = {"color": LINES[i], "linestyle": DASHES[i], "label": label}
        axes[0].plot(released.run["time"] - RELEASED_AT, released.run["contraction"] * 100, **style)
        axes[1].plot(released.run["time"] - RELEASED_AT, released.run["acceleration"], **style)
    axes[0].set_ylabel("contraction [%]")
    axes[1].set(ylabel="acceleration [m/s²]", xlabel="time after the release [s]", xlim=(-0.2, 3.0))
    legend_below(figure, axes[0])
    return captioned("hosovsky_fig4", figure)


VARIED = ("stiffness", "damping", "length", "braid_angle", "low_pressure", "high_pressure")
"""The chosen values on which the quick release depends."""
SOBOL_POINTS = 64
"""Number of Sobol points within the ranges (chosen)."""
CASE = "all chosen values varied together: share that holds"
"""Case of a claim for the joint variation."""
OBSERVED = 1.5
"""Time after the release [s] that contains the first four turning points of all cases (chosen)."""


@dataclasses.dataclass(frozen=True)
class JointCase:
    """One combination of the chosen values, and the values of the four statements for it."""

    design: str
    parameters: UnpublishedParameters
    values: dict[str, float]

    def describe(self) -> str:
        """The varied parameters with their values."""
        items = [(name.replace("_", " "), getattr(self.parameters, name)) for name in VARIED]
        scaled = [
            (name, item.value / 1e3, "kPa") if item.unit == "Pa" else (name, item.value, item.unit)
            for name, item in items
        ]
        return ", ".join(f"{name} {format_quantity(value, unit)}" for name, value, unit in scaled)


def share(cases: Sequence[JointCase], key: str, design: str | None = None) -> float:
    """The share [1] of the cases, of one design or of all, for which a statement holds; a missing
    value does not.
    """
    return float(
        np.mean([agrees(key, case.values[key]) for case in cases if design in (None, case.design)])
    )


def worst_case(cases: Sequence[JointCase], key: str) -> JointCase:
    """The case that is nearest to a violation of a statement, or violates it most."""
    values = np.array([case.values[key] for case in cases])
    margin = values if agrees(key, np.inf) else -values
    return cases[int(np.argmin(np.where(np.isnan(values), -np.inf, margin)))]


def joint_variation(parameters: UnpublishedParameters) -> list[JointCase]:
    """Return the four statements at all corners of the ranges, for both force maps, and at Sobol
    points within them.
    """
    run = functools.cache(release)  # corners share their releases
    nominal = {"low_pressure": parameters.low_pressure, "high_pressure": parameters.high_pressure}

    def case(design: str, values: Sequence[float], data: str) -> JointCase:
        point = parameters
        for name, value in zip(VARIED, values, strict=True):
            point = point.with_value(name, value)
        shared = dataclasses.replace(point, **nominal)
        low, high = (
            run(shared, pressure.value, data, RELEASED_AT + OBSERVED)
            for pressure in (point.low_pressure, point.high_pressure)
        )
        return JointCase(design, point, compare_releases(low, high))

    ranges = [(getattr(parameters, name).low, getattr(parameters, name).high) for name in VARIED]
    sobol = Sobol(SOBOL_POINTS).values([Uniform(low, high) for low, high in ranges]).tolist()
    corners = [
        case(f"corners, {data}", point, data)
        for data in FORCE_MAPS
        for point in itertools.product(*ranges)
    ]
    return [*corners, *(case("Sobol set", point, FORCE_MAPS[0]) for point in sobol)]


def joint_table(cases: Sequence[JointCase]) -> Table:
    """Return the share of the joint variations for which each statement holds, and its extreme
    values.
    """
    columns: dict[str, list[Any]] = {"statement": list(STATEMENTS)}
    for design, count in Counter(case.design for case in cases).items():
        columns[f"holds, {design}, {count} cases [%]"] = [
            100 * share(cases, key, design) for key in STATEMENTS
        ]
    values = {key: [case.values[key] for case in cases] for key in STATEMENTS}
    columns["minimum"] = [float(np.nanmin(each)) for each in values.values()]
    columns["maximum"] = [float(np.nanmax(each)) for each in values.values()]
    columns["worst case"] = [worst_case(cases, key).describe() for key in STATEMENTS]
    return titled("hosovsky_release_joint", columns)


def joint_claims(cases: Sequence[JointCase]) -> list[Claim]:
    """Return the share of the joint variations for which each claim on Fig. 4 holds, as a case of
    that claim.
    """
    result = []
    designs = dict.fromkeys(case.design for case in cases)
    for key, row in STATEMENTS.items():
        values, worst = [case.values[key] for case in cases], worst_case(cases, key)
        shares = "; ".join(
            f"{design} {100 * share(cases, key, design):.3g} %" for design in designs
        )
        note = (
            f"Share of {len(cases)} combinations of all chosen values for which it holds: {shares}."
            f" Values {np.nanmin(values):.3g} to {np.nanmax(values):.3g}"
            f" {format_unit(row.blank.unit)}".rstrip()
            + f"; worst case: {worst.describe()} ({worst.design})."
        )
        blank = dataclasses.replace(row.blank, printed=AtLeast(100.0, derived=True), unit="%")
        result.append(ClaimRow(blank).claim(CASE, 100 * share(cases, key), note))
    return result
