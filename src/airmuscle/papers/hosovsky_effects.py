"""Effects of the suspected causes of the deviations in Fig. 3 of Hošovský et al. on fill and discharge.

The paper suspects the line between valve and muscle, the flow law, the isothermal ideal gas and the constant spring;
the volume is added, as its formula is lost in our copy. One component of the printed plant is substituted at a time,
then one of each cause together. The parameter values are chosen, as the paper prints none.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ..core import DASHES, LINES, Array, new_figure
from ..report.chapter import Plot, Table
from ..report.formula import to_mathtext
from . import hosovsky_plant as rig
from .hosovsky_plant import MATRIX, Choice, UnpublishedParameters, hanging_load, plant
from .run import captioned, titled

SPACING = 4e-3
"""Output step [s]."""
PHASES = {"filling": rig.FILLING, "discharging": rig.DISCHARGING}
"""Beginning and end of both phases [s]."""


@dataclasses.dataclass(frozen=True)
class SuspectedCauses:
    """Parameters of the suspected causes; the paper prints only the length of the line, that of the sensor."""

    line_length: Choice = Choice(1.0, 0.5, 2.0, "m", "line from valve to muscle", "printed for the sensor line")
    line_diameter: Choice = Choice(4e-3, 2.5e-3, 6e-3, "m", "inner diameter of the line")
    critical_ratio: Choice = Choice(0.25, 0.2, 0.5, "1", "critical pressure ratio of the valve with fittings")
    index: Choice = Choice(0.65, 0.5, 0.7, "1", "subsonic index of the valve")
    laminar_ratio: Choice = Choice(0.97, 0.96, 0.99, "1", "pressure ratio above which the flow is laminar")
    heat_transfer: Choice = Choice(0.5, 0.1, 2.0, "W/K", "heat transfer coefficient times area, wall to air")
    hardening: Choice = Choice(100.0, 50.0, 200.0, "1", r"hardening \(h\) of the spring, \(k\,(1 + h\,\varepsilon^2)\)")
    wall_compliance: Choice = Choice(2e-11, 5e-12, 5e-11, "m3/Pa", "compliance of the wall")
    wall_time_constant: Choice = Choice(0.2, 0.05, 1.0, "s", "time constant of the viscoelastic wall")
    series_stiffness: Choice = Choice(1e5, 5e4, 3e5, "N/m", "series spring of Fig. 1, stiffness at zero stretch")
    series_hardening: Choice = Choice(
        5e-3, 2e-3, 2e-2, "m", "series spring of Fig. 1, stretch at which the force is twice the linear one"
    )
    dead_volume: Choice = Choice(2e-5, 5e-6, 4e-5, "m3", "volume of fittings and ports at the muscle")


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

    def plant(self, parameters: UnpublishedParameters) -> am.Plant:
        """Return the plant with the substituted components."""
        parts = dict(self.parts)
        if "braid_angle" in parts:
            parameters = parameters.with_value("braid_angle", parts.pop("braid_angle"))
        return plant(parameters, hanging_load(parameters), **parts)


PRINTED = Substitution("as printed", "isothermal gas, constant spring, rigid wall, no line", {})
CAUSES = ("line", "flow law", "heat transfer", "spring", "volume", "gas law")
COMBINED = "combined"


def substitutions(parameters: UnpublishedParameters, suspected: SuspectedCauses) -> tuple[Substitution, ...]:
    """Return all substitutions by cause; the last one combines one of each cause."""
    s, stiffness = suspected, parameters.stiffness.value
    series = am.physics.CubicSeriesSpring(s.series_stiffness.value, s.series_hardening.value)
    length, diameter, dead = s.line_length.value, s.line_diameter.value, s.dead_volume.value
    critical = dataclasses.replace(MATRIX, critical_ratio=s.critical_ratio.value)
    lumped, heat = (am.physics.Tube.from_dimensions(length, diameter), am.physics.EnergyBalance(s.heat_transfer.value))
    indexed = am.physics.SubsonicIndexValve(MATRIX.conductance, MATRIX.critical_ratio, s.index.value)
    laminar = dataclasses.replace(MATRIX, laminar_ratio=s.laminar_ratio.value)
    hardening = am.physics.CubicSpring(stiffness, s.hardening.value)
    wall = am.physics.ViscoelasticWall(s.wall_compliance.value, s.wall_time_constant.value)
    fittings = am.physics.Tube(am.Valve(100.0 * MATRIX.conductance, 0.5), dead)  # with a wide opening to the muscle
    angles = parameters.braid_angle
    return (
        Substitution("line", "volume and resistance", {"tube": lumped}),
        Substitution("line", "with inertia, 10 segments", {"tube": am.physics.DistributedTube(length, diameter, 10)}),
        Substitution("line", "pressure measured at the valve", {"tube": lumped}, "line_length", "tube.pressure"),
        Substitution("flow law", rf"\(b = {s.critical_ratio.value:g}\)", {"valve": critical}, "critical_ratio"),
        Substitution("flow law", rf"\(m = {s.index.value:g}\)", {"valve": indexed}, "index"),
        Substitution("flow law", f"laminar above {s.laminar_ratio.value:g}", {"valve": laminar}, "laminar_ratio"),
        *(Substitution("heat transfer", rf"first law, \(hA = {value:g}\) W/K",
                       {"gas": am.physics.EnergyBalance(value)}, varied)
          for value, varied in ((s.heat_transfer.low, ""), (s.heat_transfer.value, "heat_transfer"),
                                (s.heat_transfer.high, ""))),
        Substitution("heat transfer", "first law, adiabatic", {"gas": am.physics.EnergyBalance(0.0)}),
        Substitution("heat transfer", r"polytropic, \(n = 1.2\)", {"gas": am.Polytropic(1.2)}),
        Substitution("spring", "no spring", {"spring": am.LinearSpring(0.0)}),
        Substitution("spring", "three times the stiffness", {"spring": am.LinearSpring(3.0 * stiffness)}),
        Substitution("spring", "hardening spring", {"spring": hardening}),
        Substitution("spring", "nonlinear series spring", {"series": series}, "series_stiffness"),
        Substitution("volume", f"braid angle {angles.low:g} rad", {"braid_angle": angles.low}),
        Substitution("volume", f"braid angle {angles.high:g} rad", {"braid_angle": angles.high}),
        Substitution("volume", "viscoelastic wall", {"wall": wall}),
        Substitution("volume", f"fittings of {dead * 1e6:g} cm³", {"tube": fittings}),
        Substitution("gas law", "second virial coefficient of air", {"gas": am.physics.VirialGas()}),
        Substitution("gas law", r"volume flow of (11), \(P_0 Q\)", {"valve": rig.MATRIX_BY_VOLUME}),
        Substitution(COMBINED, r"line, \(b\), first law, spring, wall",
                     {"gas": heat, "spring": hardening, "wall": wall, "valve": critical,
                      "tube": dataclasses.replace(lumped, gas=heat)}),
    )  # fmt: skip


@dataclasses.dataclass(frozen=True, eq=False)
class Effect:
    """Changes relative to the printed plant due to a substitution: pressure [Pa] and contraction [1] over time [s]."""

    substitution: Substitution
    time: Array
    pressure: Array
    contraction: Array
    delays: tuple[float, float]
    """Delays of filling and discharging [s], at 90 % of the pressure change."""

    def largest(self, column: str, phase: tuple[float, float]) -> float:
        """Return the change of largest magnitude within a phase, with its sign."""
        change = getattr(self, column)[(self.time >= phase[0]) & (self.time <= phase[1])]
        return float(change[np.argmax(np.abs(change))])


def compute_effects(parameters: UnpublishedParameters, suspected: SuspectedCauses) -> tuple[Effect, ...]:
    """Simulate all substitutions and return their changes relative to the printed plant."""
    base = run_fill_of(PRINTED, parameters)
    return tuple(effect_of(base, item, run_fill_of(item, parameters)) for item in substitutions(parameters, suspected))


def run_fill_of(substitution: Substitution, parameters: UnpublishedParameters) -> am.Recording:
    """Simulate fill and discharge of the plant with a substituted component."""
    options: dict[str, Any] = {"integrator": am.Rodas4(1e-7), "output_times": SPACING}
    return am.simulate(substitution.plant(parameters), rig.SCHEDULE, duration=rig.DURATION, **options)


def effect_of(base: am.Recording, substitution: Substitution, run: am.Recording) -> Effect:
    """Return the changes of a run with a substituted component relative to that of the printed plant."""
    time, pressure, contraction = base["time"], run[substitution.pressure_column], run["contraction"]
    filling, discharging = (
        _response_time(run["time"], pressure, *phase) - _response_time(time, base["pressure"], *phase)
        for phase in PHASES.values()
    )
    changes = pressure - base["pressure"], contraction - base["contraction"]
    return Effect(substitution, time, *changes, (filling, discharging))


def _response_time(time: Array, pressure: Array, begin: float, end: float) -> float:
    """Return the time at which the pressure has completed 90 % of its change between two instants [s]."""
    rows = (time >= begin) & (time <= end)
    change = np.abs(pressure[rows] - pressure[rows][0])
    return float(np.interp(0.9 * change[-1], np.maximum.accumulate(change), time[rows]))


def effect_table(effects: tuple[Effect, ...]) -> Table:
    """Return the largest changes during filling and discharging, the delays, and the ratio of both phases."""
    columns: dict[str, list[Any]] = {"cause": [e.substitution.cause for e in effects],
                                     "substituted component": [e.substitution.component for e in effects]}  # fmt: skip
    for column, unit, size in (("pressure", "kPa", 1e3), ("contraction", "% of length", 0.01)):
        for name, phase in PHASES.items():
            heading = f"{column}, {name}: largest change [{unit}]"
            columns[heading] = [_round(e.largest(column, phase) / size) for e in effects]
    for i, name in enumerate(PHASES):
        columns[f"{name}: delay at 90 % [ms]"] = [_round(round(e.delays[i] * 1e3, 3)) for e in effects]
    columns["pressure, ratio of filling to discharging [1]"] = [_round(fill_discharge_ratio(e)) for e in effects]
    return titled("hosovsky_effects", columns)


def _round(value: float) -> float:
    """Return the value with three significant digits, the accuracy that chosen parameters justify."""
    return float(f"{value + 0.0:.3g}")


def fill_discharge_ratio(effect: Effect) -> float:
    """Return the ratio of the largest pressure changes during filling and during discharging."""
    return abs(effect.largest("pressure", rig.FILLING) / effect.largest("pressure", rig.DISCHARGING))


def effect_plot(effects: tuple[Effect, ...]) -> Plot:
    """Return the changes of pressure and contraction after the opening of each valve, one row per cause."""
    rows = (*CAUSES, COMBINED)
    figure, axes = new_figure(len(rows), 4, width=9.6, height=11.6, sharex="col")
    for panels, cause in zip(axes, rows, strict=True):
        _draw_row(panels, [effect for effect in effects if effect.substitution.cause == cause])
        panels[0].set_ylabel(f"{cause}\nchange [kPa]")
        panels[2].set_ylabel("change [% of L₀]")
        panels[3].legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0)
    titles = [f"{column}\n{phase}" for column in ("pressure", "contraction") for phase in PHASES]
    for j, title in enumerate(titles):
        axes[0, j].set_title(title)
        axes[-1, j].set_xlabel("time since opening [s]")
    figure.align_ylabels(axes[:, 0])
    figure.align_ylabels(axes[:, 2])
    return captioned("hosovsky_effects", figure)


def _draw_row(panels: Any, row: list[Effect]) -> None:
    """Draw one row: both phases of the pressure on one scale, both of the contraction on another."""
    for i, effect in enumerate(row):
        style = {"color": LINES[i], "linestyle": DASHES[i], "label": to_mathtext(effect.substitution.component)}
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
    largest = {cause: max((e for e in single if e.substitution.cause == cause), key=_fill_change) for cause in CAUSES}
    ordered = sorted(largest.items(), key=lambda item: -_fill_change(item[1]))
    listed = ", ".join(
        f"{cause} {_fill_change(effect) / 1e3:.3g} kPa ({effect.substitution.component})" for cause, effect in ordered
    )
    stronger = [f"{e.substitution.cause} ({e.substitution.component})" for e in single if fill_discharge_ratio(e) > 1.2]
    combined = effects[-1]
    return (
        f"Largest pressure change during filling by cause: {listed}. Filling is affected more than discharging, by at "
        f"least a fifth at the chosen values, by: {', '.join(stronger) or 'none'}. All causes combined: "
        f"{_fill_change(combined) / 1e3:.3g} kPa during filling, {fill_discharge_ratio(combined):.2g} times the "
        "change during discharging."
    )


def _fill_change(effect: Effect) -> float:
    return abs(effect.largest("pressure", rig.FILLING))
