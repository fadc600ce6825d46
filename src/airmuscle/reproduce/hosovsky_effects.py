"""Why Fig. 3 of the third paper deviates: what each cause that it suspects changes in the fill and the discharge.

The paper suspects the line between valve and muscle, the flow law, the isothermal gas and the constant spring; the
volume is added, as the paper's is lost in our copy. Each is exchanged alone in the plant as printed, then one of each
at once. What is exchanged is a component of the program; its numbers are chosen, as the paper prints none.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.plotting import DASHES, LINES, new_figure
from ..muscle import CubicSpring, LaggingWall, LinearSpring, Spring, Wall
from ..plant.plant import Plant
from ..pneumatics import DistributedTube, IndexedValve, Orifice, Tube, TubeModel, Valve
from ..pneumatics.gas import EnergyBalance, Gas, Polytropic
from ..recording import Recording
from ..report.chapter import Plot, Table
from ..simulation.integrators import Rodas4
from ..simulation.simulate import simulate
from .hosovsky_plant import MATRIX, ChosenValue, UnpublishedParameters, hanging_load, plant
from .hosovsky_schedule import DISCHARGING, DURATION, FILLING, SCHEDULE

SPACING = 4e-3
"""Between two rows [s]."""


@dataclasses.dataclass(frozen=True)
class SuspectedCauses:
    """The numbers of the suspected causes; the paper prints only the length of the line, for the sensor's."""

    line_length: ChosenValue = ChosenValue(
        1.0, 0.5, 2.0, "m", "line from valve to muscle", "printed for the sensor's line"
    )
    line_diameter: ChosenValue = ChosenValue(4e-3, 2.5e-3, 6e-3, "m", "its inner diameter")
    critical_ratio: ChosenValue = ChosenValue(0.25, 0.2, 0.5, "1", "critical ratio of the valve with its fittings")
    index: ChosenValue = ChosenValue(0.65, 0.5, 0.7, "1", "subsonic index of the valve")
    laminar_ratio: ChosenValue = ChosenValue(0.97, 0.96, 0.99, "1", "pressure ratio above which the flow is laminar")
    heat_transfer: ChosenValue = ChosenValue(0.5, 0.1, 2.0, "W/K", "heat transfer from wall to air")
    hardening: ChosenValue = ChosenValue(100.0, 50.0, 200.0, "1", "hardening of the spring, k (1 + h eps^2)")
    wall_compliance: ChosenValue = ChosenValue(2e-11, 5e-12, 5e-11, "m3/Pa", "compliance of the wall")
    wall_time_constant: ChosenValue = ChosenValue(0.2, 0.05, 1.0, "s", "time by which the wall lags")
    dead_volume: ChosenValue = ChosenValue(2e-5, 5e-6, 4e-5, "m3", "volume of fittings and ports at the muscle")

    def as_rows(self) -> tuple[tuple[str, str, str], ...]:
        """What, value with range and unit, source: as the report lists them."""
        numbers = [getattr(self, field.name) for field in dataclasses.fields(self)]
        return tuple((n.meaning, f"{n.value:g} {n.unit} (range {n.low:g} to {n.high:g})", n.source) for n in numbers)


@dataclasses.dataclass(frozen=True)
class Substitution:
    """One component of the printed plant exchanged: the cause that it stands for, and where the pressure is read."""

    cause: str
    component: str
    gas: Gas | None = None
    spring: Spring | None = None
    wall: Wall | None = None
    valve: Orifice = MATRIX
    tube: TubeModel | None = None
    braid_angle: float | None = None
    pressure_column: str = "pressure"

    def plant(self, numbers: UnpublishedParameters) -> Plant:
        """The plant with it."""
        if self.braid_angle is not None:
            numbers = numbers.with_value("braid_angle", self.braid_angle)
        return plant(
            numbers, hanging_load(numbers), gas=self.gas, spring=self.spring, valve=self.valve, tube=self.tube,
            wall=self.wall,
        )  # fmt: skip


PRINTED = Substitution("as printed", "isothermal, constant spring, rigid wall, no line")
CAUSES = ("line", "flow law", "heat", "spring", "volume")


def substitutions(numbers: UnpublishedParameters, suspected: SuspectedCauses) -> tuple[Substitution, ...]:
    """Every exchange, cause by cause, and last one of each cause at once."""
    s, stiffness = suspected, numbers.stiffness.value
    length, diameter = s.line_length.value, s.line_diameter.value
    lumped, heat = Tube.of_size(length, diameter), EnergyBalance(s.heat_transfer.value)
    indexed = IndexedValve(MATRIX.conductance, MATRIX.critical_ratio, s.index.value)
    laminar = _valve(laminar_ratio=s.laminar_ratio.value)
    hardening = CubicSpring(stiffness, s.hardening.value)
    wall = LaggingWall(s.wall_compliance.value, s.wall_time_constant.value)
    angles = numbers.braid_angle
    return (
        Substitution("line", "volume and resistance", tube=lumped),
        Substitution("line", "with inertia, 10 pieces", tube=DistributedTube(length, diameter, 10)),
        Substitution("line", "pressure read at the valve", tube=lumped, pressure_column="tube.pressure"),
        Substitution("flow law", f"b = {s.critical_ratio.value:g}", valve=_valve(critical_ratio=s.critical_ratio.value)),
        Substitution("flow law", f"m = {s.index.value:g}", valve=indexed),
        Substitution("flow law", f"laminar > {s.laminar_ratio.value:g}", valve=laminar),
        Substitution("heat", f"first law, hA = {s.heat_transfer.value:g} W/K", gas=heat),
        Substitution("heat", "first law, adiabatic", gas=EnergyBalance(0.0)),
        Substitution("heat", "polytropic, n = 1.2", gas=Polytropic(1.2)),
        Substitution("spring", "none", spring=LinearSpring(0.0)),
        Substitution("spring", "three times as stiff", spring=LinearSpring(3.0 * stiffness)),
        Substitution("spring", "hardening", spring=hardening),
        Substitution("volume", f"braid angle {angles.low:g} rad", braid_angle=angles.low),
        Substitution("volume", f"braid angle {angles.high:g} rad", braid_angle=angles.high),
        Substitution("volume", "wall that lags", wall=wall),
        Substitution("volume", f"{s.dead_volume.value * 1e6:g} cm3 of fittings", tube=_dead_volume(s.dead_volume.value)),
        Substitution("one of each", "line, b, first law, hardening, wall", heat, hardening, wall,
                  _valve(critical_ratio=s.critical_ratio.value), dataclasses.replace(lumped, gas=heat)),
    )  # fmt: skip


def _valve(**changed: float) -> Valve:
    return dataclasses.replace(MATRIX, **changed)


def _dead_volume(volume: float) -> Tube:
    """A volume that is all but open to the muscle: a hundred times the valve's conductance."""
    return Tube(Valve(100.0 * MATRIX.conductance, 0.5), volume)


@dataclasses.dataclass(frozen=True, eq=False)
class Effect:
    """What an exchange changes against the plant as printed: pressure [Pa] and contraction [1] over `time` [s]."""

    substitution: Substitution
    time: Array
    pressure: Array
    contraction: Array
    delays: tuple[float, float]
    """By how much filling and discharging come later [s], at 90 % of their way in pressure."""

    def largest(self, column: str, phase: tuple[float, float]) -> float:
        """The change that is largest in size within a phase, with its sign."""
        change = getattr(self, column)[(self.time >= phase[0]) & (self.time <= phase[1])]
        return float(change[np.argmax(np.abs(change))])


def compute_effects(numbers: UnpublishedParameters, suspected: SuspectedCauses) -> tuple[Effect, ...]:
    """Every exchange, run and held against the plant as printed."""
    base = _run(PRINTED, numbers)
    return tuple(_effect(base, one, _run(one, numbers)) for one in substitutions(numbers, suspected))


def _run(exchanged: Substitution, numbers: UnpublishedParameters) -> Recording:
    return simulate(exchanged.plant(numbers), SCHEDULE, duration=DURATION, method=Rodas4(1e-7), output=SPACING)


def _effect(base: Recording, exchanged: Substitution, run: Recording) -> Effect:
    pressure, contraction = run[exchanged.pressure_column] - base["pressure"], run["contraction"] - base["contraction"]
    delays = [
        _response_time(run["time"], run[exchanged.pressure_column], *phase)
        - _response_time(base["time"], base["pressure"], *phase)
        for phase in (FILLING, DISCHARGING)
    ]
    return Effect(exchanged, base["time"], pressure, contraction, (delays[0], delays[1]))


def _response_time(time: Array, pressure: Array, begin: float, end: float) -> float:
    """When the pressure has gone 90 % of its way between two instants [s]."""
    here = (time >= begin) & (time <= end)
    way = np.abs(pressure[here] - pressure[here][0])
    return float(np.interp(0.9 * way[-1], np.maximum.accumulate(way), time[here]))


def effect_table(found: tuple[Effect, ...]) -> Table:
    """The greatest changes while filling and discharging, the delays, and how much more filling is changed."""
    phases = (("filling", FILLING), ("discharging", DISCHARGING))
    columns: dict[str, list[Any]] = {"cause": [e.substitution.cause for e in found],
                                     "exchanged": [e.substitution.component for e in found]}  # fmt: skip
    for column, unit, size in (("pressure", "kPa", 1e3), ("contraction", "% of length", 0.01)):
        for word, phase in phases:
            columns[f"{column}, {word}: greatest change [{unit}]"] = [
                _round(e.largest(column, phase) / size) for e in found
            ]
    for i, (word, _) in enumerate(phases):
        columns[f"{word} later at 90 % [ms]"] = [_round(round(e.delays[i] * 1e3, 3)) for e in found]
    columns["pressure, filling to discharging [1]"] = [_round(fill_discharge_ratio(e)) for e in found]
    note = (
        "each exchanged alone in the plant as printed, all numbers chosen; the last ratio is above 1 where filling "
        "suffers more, as the paper sees it"
    )
    return Table("hosovsky_effects", "What each suspected cause of the deviations in Fig. 3 changes", columns, note)


def _round(value: float) -> float:
    """Three digits: more would say more than chosen numbers can."""
    return float(f"{value + 0.0:.3g}")


def fill_discharge_ratio(effect: Effect) -> float:
    """The greatest change of pressure while filling by that while discharging."""
    return abs(effect.largest("pressure", FILLING) / effect.largest("pressure", DISCHARGING))


def effect_plot(found: tuple[Effect, ...]) -> Plot:
    """The changes of pressure and contraction after each valve opens, a row for each cause."""
    rows = (*CAUSES, "one of each")
    drawn, axes = new_figure(len(rows), 4, width=9.6, height=10.0, sharex="col")
    for across, cause in zip(axes, rows, strict=True):
        _draw_row(across, [effect for effect in found if effect.substitution.cause == cause])
        across[0].set_ylabel(f"{cause}\nchange [kPa]")
        across[2].set_ylabel("change [% of L₀]")
        across[3].legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0)
    titles = [f"{column}\n{phase}" for column in ("pressure", "contraction") for phase in ("filling", "discharging")]
    for j, title in enumerate(titles):
        axes[0, j].set_title(title)
        axes[-1, j].set_xlabel("time since the valve [s]")
    drawn.align_ylabels(axes[:, 0])
    drawn.align_ylabels(axes[:, 2])
    caption = (
        "Fill and discharge: what each suspected cause changes against the plant as printed (isothermal, constant "
        "spring, rigid wall, no line), after the fill valve opens and after the discharge valve does."
    )
    return Plot("hosovsky_effects", caption, drawn)


def _draw_row(across: Any, found: list[Effect]) -> None:
    """One row of the figure: both phases of the pressure on one scale, both of the contraction on another."""
    for i, effect in enumerate(found):
        style = {"color": LINES[i], "linestyle": DASHES[i], "label": effect.substitution.component}
        for j, (phase, shown) in enumerate(((FILLING, 3.0), (DISCHARGING, 4.0))):
            since = effect.time - phase[0]
            here = (since >= -0.1) & (since <= shown)
            across[j].plot(since[here], effect.pressure[here] / 1e3, **style)
            across[2 + j].plot(since[here], effect.contraction[here] * 100, **style)
    for left, right in (across[:2], across[2:]):
        limits = [*left.get_ylim(), *right.get_ylim()]
        for axes in (left, right):
            axes.set_ylim(min(limits), max(limits))
        right.tick_params(labelleft=False)


def describe_effects(found: tuple[Effect, ...]) -> str:
    """What the table says on the paper's remark that filling deviates more than discharging."""
    single = [e for e in found if e.substitution.cause in CAUSES]
    sizes = {cause: max((e for e in single if e.substitution.cause == cause), key=_fill_change) for cause in CAUSES}
    ordered = sorted(sizes.items(), key=lambda item: -_fill_change(item[1]))
    greatest = ", ".join(
        f"{cause} {_fill_change(effect) / 1e3:.3g} kPa ({effect.substitution.component})" for cause, effect in ordered
    )
    more = [f"{e.substitution.cause} ({e.substitution.component})" for e in single if fill_discharge_ratio(e) > 1.2]
    together = found[-1]
    return (
        f"greatest change of pressure while filling, by cause: {greatest}. Filling suffers more than discharging, by "
        f"a fifth at least, from: {', '.join(more) or 'none'}. One of each at once: "
        f"{_fill_change(together) / 1e3:.3g} kPa while filling, {fill_discharge_ratio(together):.2g} times that while discharging"
    )


def _fill_change(effect: Effect) -> float:
    return abs(effect.largest("pressure", FILLING))
