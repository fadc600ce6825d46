"""Fill records of an unloaded muscle from a folder: what a gas law, a growing volume, and a line before it leave over.

./run python benchmarks/real_fills.py FOLDER_OR_FILES...   (CSV with time and pressure; a record is one fill)
"""

from __future__ import annotations

import argparse
import dataclasses
import pathlib
import time

import numpy as np

from airmuscle.control.inputs import Schedule
from airmuscle.geometry import Vessel
from airmuscle.identify.dynamic import (
    DynamicFit,
    Experiment,
    InitialConditions,
    InitialValue,
    StartTime,
    fit_dynamic,
    locate_pressure_sensor,
)
from airmuscle.mechanism import Isometric
from airmuscle.muscle import Muscle, SwellingWall
from airmuscle.plant.plant import Plant
from airmuscle.pneumatics import FillDischarge, Supply, Tube, Valve, WithTubes
from airmuscle.pneumatics.gas import Gas, Isothermal, Polytropic
from airmuscle.recording import Recording, read_csv

SENSOR = 500.0
"""Standard deviation of a reading [Pa], near that of the records' ends; chosen."""
END = 5.0
"""Rows after this [s] are at rest and say nothing more; chosen."""
REST_VOLUME = 1e-4
"""The volume at rest is not known: 100 mL stands for it, and conductances and volumes go with it."""
OPEN = Schedule({"fill": ((0.0, 1.0),)})
BOUNDS = {
    "supply.pressure": (590e3, 660e3), "fill.critical_ratio": (0.1, 0.6), "growth_volume": (0.0, 2 * REST_VOLUME),
    "midpoint_pressure": (0.0, 600e3), "pressure_width": (1e4, 3e5), "time_constant": (0.01, 5.0),
}  # fmt: skip
"""Physical, chosen: the building's air is 620 kPa nominal, valves have b of 0.1 to 0.6, a muscle at most trebles."""


@dataclasses.dataclass(frozen=True)
class Model:
    """A variant: the plant from which the search starts, what is free, and where the sensor sits."""

    name: str
    plant: Plant
    free: tuple[str, ...]
    sensed: str = "pressure"

    @property
    def supply(self) -> str:
        """Path of the supply's pressure."""
        return f"{self.valves}supply.pressure"

    @property
    def valves(self) -> str:
        """What the paths of the valves begin with."""
        return "circuit.circuit." if isinstance(self.plant.circuit, WithTubes) else "circuit."

    def own(self, wall: bool) -> tuple[str | StartTime | InitialValue, ...]:
        """What every record has for itself; with the start of its wall, if asked."""
        nuisances = (StartTime(0.012), InitialValue("pressure", 3e3), self.supply)
        return (*nuisances, InitialValue("wall_volume", 1e-5)) if wall else nuisances

    def bounds(self) -> dict[str, tuple[float, float]]:
        """Physical bounds of what is free."""
        named = (*self.free, self.supply)
        return {path: pair for end, pair in BOUNDS.items() for path in named if path.endswith(end)}


def plant(gas: Gas, growth: float, lag: float, line: bool) -> Plant:
    """An unloaded muscle of unknown length behind a valve, and a line if asked."""
    muscle = dataclasses.replace(Muscle.ideal(Vessel(REST_VOLUME)), wall=SwellingWall(growth, 150e3, 5e4, lag))
    valves = FillDischarge(Supply(625e3), Valve(5e-10, 0.4), Valve(0.0, 0.3))
    circuit = WithTubes(valves, Tube(Valve(1.3e-9, 0.3), 2e-5, gas=gas)) if line else valves
    return Plant(muscle, circuit, Isometric(0.0), gas)


def model(name: str, gas: Gas, *, growing: bool = False, lagging: bool = False, line: bool = False) -> Model:
    """A variant by what it has."""
    valves = "circuit.circuit." if line else "circuit."
    free = [f"{valves}fill.conductance", f"{valves}fill.critical_ratio"]
    free += ["circuit.tube.volume", "circuit.tube.orifice.conductance"] if line else []
    free += [f"muscle.wall.{part}" for part in ("growth_volume", "midpoint_pressure", "pressure_width")] if growing else []
    free += ["muscle.wall.time_constant"] if lagging else []
    start = plant(gas, REST_VOLUME if growing else 0.0, 0.2 if lagging else 0.005, line)
    return Model(name, start, tuple(free), "tube.pressure" if line else "pressure")


MODELS = (
    model("isothermal, constant volume", Isothermal()),
    model("polytropic 1.2, growing volume", Polytropic(), growing=True),
    model("polytropic 1.2, growing volume with lag", Polytropic(), growing=True, lagging=True),
    model("line, constant volume, sensed in the line", Polytropic(), line=True),
    model("line, growing volume with lag, sensed in the line", Polytropic(), growing=True, lagging=True, line=True),
)


def record(path: pathlib.Path) -> Recording:
    """The part of a record in which something happens; both sensors' names stand for its one pressure."""
    found = read_csv(path)
    found = found.rows(found["time"] < END)
    return found.with_columns(**{"tube.pressure": found["pressure"]})


def experiment(start_plant: Plant, found: Recording, wall: bool = False) -> Experiment:
    """The fill as an experiment that begins at the first row that leaves the start."""
    pressure, first = found["pressure"], float(np.median(found["pressure"][:2]))
    begin = float(found["time"][max(int(np.argmax(pressure > first + 5e3)) - 1, 0)])
    start = InitialConditions.at_coordinates(start_plant, first)
    if wall:  # known, so that it can be an unknown of its own
        known = {**start.known, "wall_volume": start.guess["wall_volume"]}
        still = tuple(name for name in start.stationary if name != "wall_volume")
        start = dataclasses.replace(start, known=known, still=still)
    return Experiment(found, OPEN, start, begin)


def fitted(variant: Model, found: Recording, starts: int) -> DynamicFit:
    """The variant fitted to one record; start, start time and supply pressure are its nuisances."""
    return fit_dynamic(
        variant.plant, [experiment(variant.plant, found)], free=variant.free, observed={variant.sensed: SENSOR},
        bounds=variant.bounds(), per_record=variant.own(False), starts=starts,
    )  # fmt: skip


def predicted(fit: DynamicFit, variant: Model, found: Recording, wall: bool) -> float:
    """Rms [Pa] of a fit's prediction of another record, of which only the nuisances are taken."""
    settled = fit.plant()
    assert isinstance(settled, Plant)
    again = fit_dynamic(
        settled, [experiment(settled, found, wall)], free=(), per_record=variant.own(wall), observed={variant.sensed: SENSOR},
        bounds={variant.supply: BOUNDS["supply.pressure"]},
    )  # fmt: skip
    return again.rms(variant.sensed)


def show_record(name: str, fits: list[DynamicFit]) -> None:
    """Residuals of every variant, the last one's estimates, and the profiles of what matters."""
    inside = min((f for f, m in zip(fits, MODELS, strict=True) if m.sensed == "pressure" and "lag" not in m.name),
                 key=lambda f: f.rms("pressure"))  # fmt: skip
    print(f"\n## {name}: {locate_pressure_sensor(in_muscle=inside, in_line=fits[-1])}")
    for variant, fit in zip(MODELS, fits, strict=True):
        bound = [e.name for e in fit.estimates if e.on_bound]
        words = f"; on bounds: {', '.join(bound)}" if bound else ""
        print(f"{fit.rms(variant.sensed) / 1e3:7.2f} kPa rms  {variant.name}; {len(fit.estimates)} unknowns{words}")
    print(f"\n{fits[-1]}\n")
    for path in ("circuit.circuit.fill.critical_ratio", "circuit.circuit.fill.conductance",
                 "muscle.wall.growth_volume", "circuit.tube.volume", "muscle.wall.time_constant"):  # fmt: skip
        if not fits[-1][path].on_bound:
            print(fits[-1].profile(path, 4))


def main() -> None:
    """Print the table, the last variant's estimates and profiles, and what each fit says of the other records."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", type=pathlib.Path)
    parser.add_argument("--starts", type=int, default=10)
    options = parser.parse_args()
    files = [f for p in options.paths for f in (sorted(p.glob("*fill*.csv")) if p.is_dir() else [p])]
    begun, records, last = time.perf_counter(), [record(f) for f in files], []
    for path, found in zip(files, records, strict=True):
        fits = [fitted(variant, found, options.starts) for variant in MODELS]
        last.append(fits[-1])
        show_record(path.name, fits)
    for wall in (False, True):
        taken = "supply, start and start time" + (", and the start of its wall," if wall else "")
        print(f"\n## One record's fit on another, rms [kPa]; only {taken} are the other's own")
        for i, fit in enumerate(last):
            print(files[i].name, *(f"{predicted(fit, MODELS[-1], r, wall) / 1e3:8.2f}" for r in records))
    print(f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
