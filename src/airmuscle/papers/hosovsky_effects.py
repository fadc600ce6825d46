"""Effects of the suspected causes of the deviations in Fig. 3 of Hošovský et al. on fill and
discharge.

The paper suspects the line between valve and muscle, the flow law, the isothermal ideal gas and the
constant spring; the volume is added, as its formula is lost in our copy. One component of the
printed plant is substituted at a time, then one of each cause together. The parameter values are
chosen, as the paper prints none.
"""

import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

import airmuscle as am

from ..core import DASHES, LINES, Array, new_figure
from ..report.chapter import Plot, Table
from ..report.formatting import format_unit, to_mathtext
from . import hosovsky_plant as rig
from .hosovsky_plant import MATRIX, Choice, UnpublishedParameters, hanging_load, plant
from .run import captioned, titled

SPACING = 4e-3
"""Output step [s]."""
PHASES = {"filling": rig.FILLING, "discharging": rig.DISCHARGING}
"""Beginning and end of both phases [s]."""
STRONGER = 1.2
"""Ratio above which filling is affected more than discharging, by at least a fifth (chosen)."""
SMALLEST_EFFECT = 100.0
"""Pressure change [Pa] below which a ratio has no meaning (chosen)."""


@dataclasses.dataclass(frozen=True)
class SuspectedCauses:
    """Parameters of the suspected causes; the paper prints only the length of the line, that of the
    sensor.
    """

    line_length: Choice = Choice(
        1.0, 0.5, 2.0, "m", "line from valve to muscle", "printed for the sensor line"
    )
    line_diameter: Choice = Choice(4e-3, 2.5e-3, 6e-3, "m", "inner diameter of the line")
    critical_ratio: Choice = Choice(
        0.25, 0.2, 0.5, "1", "critical pressure ratio of the valve with fittings"
    )
    index: Choice = Choice(0.65, 0.5, 0.7, "1", "subsonic index of the valve")
    laminar_ratio: Choice = Choice(
        0.97, 0.96, 0.99, "1", "pressure ratio above which the flow is laminar"
    )
    heat_transfer: Choice = Choice(
        0.5, 0.1, 2.0, "W/K", "heat transfer coefficient times area, wall to air"
    )
    hardening: Choice = Choice(
        100.0, 50.0, 200.0, "1", r"hardening \(h\) of the spring, \(k\,(1 + h\,\varepsilon^2)\)"
    )
    wall_compliance: Choice = Choice(2e-11, 5e-12, 5e-11, "m3/Pa", "compliance of the wall")
    wall_time_constant: Choice = Choice(
        0.2, 0.05, 1.0, "s", "time constant of the viscoelastic wall"
    )
    series_stiffness: Choice = Choice(
        1e5, 5e4, 3e5, "N/m", "series spring of Fig. 1, stiffness at zero stretch"
    )
    series_hardening: Choice = Choice(
        5e-3,
        2e-3,
        2e-2,
        "m",
        "series spring of Fig. 1, stretch at which the force is twice the linear one",
    )
    dead_volume: Choice = Choice(
        2e-5, 5e-6, 4e-5, "m3", "volume of fittings and ports at the muscle"
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Substitution:
    """Substituted components of the printed plant with their cause.

    parts            components by their names in `plant`, or the braid angle
    varied           field of SuspectedCauses over whose range the ratio of both phases is stated
    pressure_column  column of the measured pressure
    """

    cause: str
    component: str
    parts: Mapping[str, Any]
    varied: str = ""
    pressure_column: str = "pressure"


PRINTED = Substitution("as printed", "isothermal gas, constant spring, rigid wall, no line", {})
CAUSES = ("line", "flow law", "heat transfer", "spring", "volume", "gas law")
COMBINED = "combined"


def substitutions(
    parameters: UnpublishedParameters, suspected: SuspectedCauses
) -> tuple[Substitution, ...]:
    """Return all substitutions by cause; the last one combines one of each cause."""
    s = suspected
    stiffness = parameters.stiffness.value
    series = am.physics.CubicSeriesSpring(s.series_stiffness.value, s.series_hardening.value)
    length = s.line_length.value
    diameter = s.line_diameter.value
    dead = s.dead_volume.value
    critical = dataclasses.replace(MATRIX, critical_ratio=s.critical_ratio.value)
    lumped = am.physics.Tube.from_dimensions(length, diameter)
    heat = am.physics.EnergyBalance(s.heat_transfer.value)
    indexed = am.physics.SubsonicIndexValve(
        MATRIX.conductance, MATRIX.critical_ratio, s.index.value
    )
    laminar = dataclasses.replace(MATRIX, laminar_ratio=s.laminar_ratio.value)
    hardening = am.physics.CubicSpring(stiffness, s.hardening.value)
    wall = am.physics.ViscoelasticWall(s.wall_compliance.value, s.wall_time_constant.value)
    fittings = am.physics.Tube(
        am.Valve(100.0 * MATRIX.conductance, 0.5), dead
    )  # with a wide opening to the muscle
    angles = parameters.braid_angle
    return (
        Substitution("line", "volume and resistance", {"tube": lumped}),
        Substitution(
            "line",
            "with inertia, 10 segments",
            {"tube": am.physics.DistributedTube(length, diameter, 10)},
        ),
        Substitution(
            "line",
            "pressure measured at the valve",
            {"tube": lumped},
            "line_length",
            "tube.pressure",
        ),
        Substitution(
            "flow law",
            rf"\(b = {s.critical_ratio.value:g}\)",
            {"valve": critical},
            "critical_ratio",
        ),
        Substitution("flow law", rf"\(m = {s.index.value:g}\)", {"valve": indexed}, "index"),
        Substitution(
            "flow law",
            f"laminar above {s.laminar_ratio.value:g}",
            {"valve": laminar},
            "laminar_ratio",
        ),
        *(
            Substitution(
                "heat transfer",
                rf"first law, \(hA = {value:g}\) W/K",
                {"gas": am.physics.EnergyBalance(value)},
                varied,
            )
            for value, varied in (
                (s.heat_transfer.low, ""),
                (s.heat_transfer.value, "heat_transfer"),
                (s.heat_transfer.high, ""),
            )
        ),
        Substitution(
            "heat transfer", "first law, adiabatic", {"gas": am.physics.EnergyBalance(0.0)}
        ),
        Substitution("heat transfer", r"polytropic, \(n = 1.2\)", {"gas": am.Polytropic(1.2)}),
        Substitution("spring", "no spring", {"spring": am.LinearSpring(0.0)}),
        Substitution(
            "spring", "three times the stiffness", {"spring": am.LinearSpring(3.0 * stiffness)}
        ),
        Substitution("spring", "hardening spring", {"spring": hardening}),
        Substitution("spring", "nonlinear series spring", {"series": series}, "series_stiffness"),
        Substitution("volume", f"braid angle {angles.low:g} rad", {"braid_angle": angles.low}),
        Substitution("volume", f"braid angle {angles.high:g} rad", {"braid_angle": angles.high}),
        Substitution("volume", "viscoelastic wall", {"wall": wall}),
        Substitution("volume", f"fittings of {dead * 1e6:g} cm³", {"tube": fittings}),
        Substitution(
            "gas law", "second virial coefficient of air", {"gas": am.physics.VirialGas()}
        ),
        Substitution("gas law", r"volume flow of (11), \(P_0 Q\)", {"valve": rig.MATRIX_BY_VOLUME}),
        Substitution(
            COMBINED,
            r"line, \(b\), first law, spring, wall",
            {
                "gas": heat,
                "spring": hardening,
                "wall": wall,
                "valve": critical,
                "tube": dataclasses.replace(lumped, gas=heat),
            },
        ),
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Effect:
    """Changes relative to the printed plant due to a substitution: pressure [Pa] and contraction
    [1] over time [s].

    `delays` are those of filling and discharging [s], at 90 % of the pressure change.
    """

    substitution: Substitution
    time: Array
    pressure: Array
    contraction: Array
    delays: tuple[float, ...]

    def largest(self, column: str, phase: tuple[float, float]) -> float:
        """Return the change of largest magnitude within a phase, with its sign."""
        change = getattr(self, column)[(self.time >= phase[0]) & (self.time <= phase[1])]
        return float(change[np.argmax(np.abs(change))])

    @property
    def filling(self) -> float:
        """Magnitude of the largest pressure change during filling [Pa]."""
        return abs(self.largest("pressure", rig.FILLING))

    @property
    def ratio(self) -> float:
        """Ratio of the largest pressure changes during filling and during discharging."""
        return abs(
            self.largest("pressure", rig.FILLING) / self.largest("pressure", rig.DISCHARGING)
        )


def compute_effects(
    parameters: UnpublishedParameters, suspected: SuspectedCauses
) -> tuple[Effect, ...]:
    """Simulate all substitutions and return their changes relative to the printed plant."""
    base = run_fill_of(PRINTED, parameters)
    return tuple(effect_of(base, item, parameters) for item in substitutions(parameters, suspected))


def run_fill_of(substitution: Substitution, parameters: UnpublishedParameters) -> am.Recording:
    """Simulate fill and discharge of the plant with a substituted component."""
    parts = dict(substitution.parts)
    method = am.Rodas4(1e-7)
    parameters = parameters.with_value(
        "braid_angle", parts.pop("braid_angle", parameters.braid_angle.value)
    )
    system = plant(parameters, hanging_load(parameters), **parts)
    return am.simulate(
        system, rig.SCHEDULE, duration=rig.DURATION, integrator=method, output_times=SPACING
    )


def effect_of(
    base: am.Recording, substitution: Substitution, parameters: UnpublishedParameters
) -> Effect:
    """Simulate a substitution and return its changes relative to the run of the printed plant."""
    run = run_fill_of(substitution, parameters)
    time = base["time"]
    pressure = run[substitution.pressure_column]
    contraction = run["contraction"]
    delays = tuple(
        _response_time(run["time"], pressure, *phase)
        - _response_time(time, base["pressure"], *phase)
        for phase in PHASES.values()
    )
    return Effect(
        substitution, time, pressure - base["pressure"], contraction - base["contraction"], delays
    )


def _response_time(time: Array, pressure: Array, begin: float, end: float) -> float:
    """Return the time at which the pressure has completed 90 % of its change between two instants
    [s].
    """
    rows = (time >= begin) & (time <= end)
    change = np.abs(pressure[rows] - pressure[rows][0])
    return float(np.interp(0.9 * change[-1], np.maximum.accumulate(change), time[rows]))


def effect_table(effects: tuple[Effect, ...]) -> Table:
    """Return the largest changes during filling and discharging, the delays, and the ratio of both
    phases.
    """
    columns: dict[str, list[Any]] = {
        "cause": [e.substitution.cause for e in effects],
        "substituted component": [e.substitution.component for e in effects],
    }
    for column, unit, size in (("pressure", "kPa", 1e3), ("contraction", "% of length", 0.01)):
        for name, phase in PHASES.items():
            heading = f"{column}, {name}: largest change [{unit}]"
            columns[heading] = [_round(e.largest(column, phase) / size) for e in effects]
    for i, name in enumerate(PHASES):
        columns[f"{name}: delay at 90 % [ms]"] = [
            _round(round(e.delays[i] * 1e3, 3)) for e in effects
        ]
    columns["pressure, ratio of filling to discharging [1]"] = [_round(e.ratio) for e in effects]
    return titled("hosovsky_effects", columns)


def _round(value: float) -> float:
    """Return the value with three significant digits, the accuracy that chosen parameters
    justify.
    """
    return float(f"{value + 0.0:.3g}")


def effect_plot(effects: tuple[Effect, ...]) -> Plot:
    """Return the changes of pressure and contraction after the opening of each valve, one row per
    cause.
    """
    rows = (*CAUSES, COMBINED)
    figure, axes = new_figure(len(rows), 4, width=9.6, height=11.6, sharex="col")
    for panels, cause in zip(axes, rows, strict=True):
        _draw_row(panels, [effect for effect in effects if effect.substitution.cause == cause])
        panels[0].set_ylabel(f"{cause}\nchange [kPa]")
        panels[2].set_ylabel("change [% of L₀]")
        panels[3].legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0)
    for j, (column, phase) in enumerate(itertools.product(("pressure", "contraction"), PHASES)):
        axes[0, j].set_title(f"{column}\n{phase}")
        axes[-1, j].set_xlabel("time since opening [s]")
    figure.align_ylabels(axes[:, 0])
    figure.align_ylabels(axes[:, 2])
    return captioned("hosovsky_effects", figure)


def _draw_row(panels: Any, row: list[Effect]) -> None:
    """Draw one row: both phases of the pressure on one scale, both of the contraction on
    another.
    """
    for i, effect in enumerate(row):
        style = {
            "color": LINES[i],
            "linestyle": DASHES[i],
            "label": to_mathtext(effect.substitution.component),
        }
        for j, (phase, duration) in enumerate(((rig.FILLING, 3.0), (rig.DISCHARGING, 4.0))):
            since = effect.time - phase[0]
            shown = (since >= -0.1) & (since <= duration)
            panels[j].plot(since[shown], effect.pressure[shown] / 1e3, **style)
            panels[2 + j].plot(since[shown], effect.contraction[shown] * 100, **style)
    for left, right in (panels[:2], panels[2:]):
        limits = [*left.get_ylim(), *right.get_ylim()]
        for axes in (left, right):
            axes.set_ylim(min(limits), max(limits))
        right.tick_params(labelleft=False)


def describe_effects(effects: tuple[Effect, ...]) -> str:
    """Return a summary of the effects with regard to the larger deviations during filling."""
    single = [e for e in effects if e.substitution.cause in CAUSES]
    largest = dict[str, Effect]()
    for effect in sorted(single, key=lambda e: -e.filling):
        largest.setdefault(effect.substitution.cause, effect)
    listed = ", ".join(
        f"{c} {e.filling / 1e3:.3g} kPa ({e.substitution.component})" for c, e in largest.items()
    )
    stronger = [
        f"{e.substitution.cause} ({e.substitution.component})" for e in single if e.ratio > STRONGER
    ]
    combined = effects[-1]
    return (
        f"Largest pressure change during filling by cause: {listed}. Filling is affected more than"
        " discharging, by at least a fifth at the chosen values, by:"
        f" {', '.join(stronger) or 'none'}. All causes combined: {combined.filling / 1e3:.3g} kPa"
        f" during filling, {combined.ratio:.2g} times the change during discharging."
    )


class RatioRange(NamedTuple):
    """Ratio of filling to discharging at both ends of a parameter's range and at its chosen value;
    NaN if no effect.

    `stronger` is whether filling is affected more by at least a fifth at all values that have an
    effect.
    """

    meaning: str
    unit: str
    values: tuple[float, ...]
    ratios: tuple[float, ...]
    stronger: bool


def ratio_ranges(
    parameters: UnpublishedParameters, suspected: SuspectedCauses
) -> tuple[RatioRange, ...]:
    """Simulate fill and discharge at the low end, the chosen value and the high end of each
    parameter.
    """
    base = run_fill_of(PRINTED, parameters)

    def ratio(name: str, value: float) -> float:
        varied = dataclasses.replace(
            suspected, **{name: dataclasses.replace(getattr(suspected, name), value=value)}
        )
        chosen = next(s for s in substitutions(parameters, varied) if s.varied == name)
        effect = effect_of(base, chosen, parameters)
        return math.nan if effect.filling < SMALLEST_EFFECT else effect.ratio

    result = []
    for name in (s.varied for s in substitutions(parameters, suspected) if s.varied):
        item = getattr(suspected, name)
        values = (item.low, item.value, item.high)
        ratios = tuple(ratio(name, value) for value in values)
        stronger = all(math.isnan(each) or each > STRONGER for each in ratios)
        result.append(RatioRange(item.meaning, item.unit, values, ratios, stronger))
    return tuple(result)


def range_table(ranges: tuple[RatioRange, ...]) -> Table:
    """Return the ratios of filling to discharging over the ranges of the parameters."""
    columns: dict[str, list[Any]] = {
        "parameter": [r.meaning for r in ranges],
        "unit": [format_unit(r.unit) for r in ranges],
    }
    places = ("low end", "chosen value", "high end")
    columns |= {place: [r.values[i] for r in ranges] for i, place in enumerate(places)}
    for i, place in enumerate(places):
        ratios = [r.ratios[i] for r in ranges]
        columns[f"ratio at the {place} [1]"] = [
            None if math.isnan(each) else _round(each) for each in ratios
        ]
    return titled("hosovsky_effect_ranges", columns)


def describe_ranges(ranges: tuple[RatioRange, ...]) -> str:
    """Return for which parameters filling is affected more by at least a fifth over their whole
    range.
    """
    listed = "{} (ratio {:.3g}, {:.3g} and {:.3g} at {:g}, {:g} and {:g} {})"
    failing = [
        listed.format(r.meaning, *r.ratios, *r.values, format_unit(r.unit)).replace(" )", ")")
        for r in ranges
        if not r.stronger
    ]
    held = [r.meaning for r in ranges if r.stronger]
    text = f"Over the whole range of its parameter this holds for: {', '.join(held) or 'none'}."
    return text + (f" It does not hold over the range of: {', '.join(failing)}." if failing else "")
