"""Fill records of an unloaded muscle from a folder: what a gas law, a growing volume, and a line before it leave over.

./run python benchmarks/real_fills.py FOLDER_OR_FILES...   (CSV with time and pressure; a record is one fill)
"""

from __future__ import annotations

import argparse
import dataclasses
import pathlib
import time
from collections.abc import Sequence

import numpy as np

from airmuscle.circuit import Supply, Valve
from airmuscle.command import Schedule
from airmuscle.gas import Isothermal
from airmuscle.identify.dynamic import DynamicFit, Experiment, FreeFill, Start, StartTime, StartValue, fit_dynamic
from airmuscle.recording import Recording, read_csv

SENSOR = 500.0
"""Standard deviation of a reading [Pa], near that of the records' ends; chosen."""
END = 5.0
"""Rows after this [s] are at rest and say nothing more; chosen."""
OPEN = Schedule({"fill": ((0.0, 1.0),)})
VALVE = ("valve.conductance", "valve.critical_ratio")
LINE = ("line_volume", "line.conductance")
GROWTH = ("growth_volume", "middle", "breadth", "lag")
BOUNDS = {
    "supply.pressure": (590e3, 660e3), "lag": (0.01, 1.0), "middle": (0.0, 600e3), "breadth": (1e4, 3e5),
}  # fmt: skip
"""Chosen: the building's air is 620 kPa nominal; an unloaded muscle has contracted before that."""
BLANK = FreeFill(
    Supply(625e3), Valve(5e-10, 0.4), Valve(1.3e-9, 0.3), line_volume=2e-5, rest_volume=1e-4, growth_volume=1e-4,
    middle=150e3, breadth=5e4, lag=0.2,
)  # fmt: skip
"""Where the search starts. The volume at rest is not known: 100 mL stands for it, and conductances go with it."""
WIDE = dataclasses.replace(BLANK, line=Valve(1e-7, 0.3), line_volume=1e-6)
"""No line to speak of."""


@dataclasses.dataclass(frozen=True)
class Model:
    """A variant: its start, what is free, and where the sensor sits."""

    name: str
    plant: FreeFill
    free: tuple[str, ...]
    sensed: str = "pressure"


MODELS = (
    Model("isothermal, constant volume", dataclasses.replace(WIDE, growth_volume=0.0, gas=Isothermal()), VALVE),
    Model("polytropic 1.2, growing volume", WIDE, (*VALVE, *GROWTH)),
    Model("line, constant volume, sensed in the line", dataclasses.replace(BLANK, growth_volume=0.0),
          (*VALVE, *LINE), "line.pressure"),
    Model("line, growing volume with lag, sensed in the line", BLANK, (*VALVE, *LINE, *GROWTH), "line.pressure"),
)  # fmt: skip


def record(path: pathlib.Path) -> Recording:
    """The part of a record in which something happens; both sensors' names stand for its one pressure."""
    found = read_csv(path)
    found = found.rows(found["time"] < END)
    return found.with_columns(**{"line.pressure": found["pressure"]})


def experiment(plant: FreeFill, found: Recording) -> Experiment:
    """The fill as an experiment that begins at the first row that leaves the start."""
    pressure, first = found["pressure"], float(np.median(found["pressure"][:2]))
    begin = float(found["time"][max(int(np.argmax(pressure > first + 5e3)) - 1, 0)])
    start = Start({"line.pressure": first, "pressure": first}, plant.guess(first), ("volume",))
    return Experiment(found, OPEN, start, begin)


def fitted(model: Model, found: Recording, starts: int) -> DynamicFit:
    """The variant fitted to one record; start, start time and supply pressure are its nuisances."""
    bounds = {name: pair for name, pair in BOUNDS.items() if name in (*model.free, "supply.pressure")}
    return fit_dynamic(
        model.plant, [experiment(model.plant, found)], free=model.free, observed={model.sensed: SENSOR}, bounds=bounds,
        own=(StartTime(0.012), StartValue("pressure", 3e3), StartValue("line.pressure", 3e3), "supply.pressure"),
        starts=starts,
    )  # fmt: skip


def predicted(fit: DynamicFit, model: Model, found: Recording) -> float:
    """Rms [Pa] of a fit's prediction of another record, of which only supply, start time and start are taken."""
    plant = fit.plant()
    assert isinstance(plant, FreeFill)
    own = (StartTime(0.012), StartValue("pressure", 3e3), StartValue("line.pressure", 3e3), "supply.pressure")
    found_again = fit_dynamic(
        plant, [experiment(plant, found)], free=(), own=own, observed={model.sensed: SENSOR},
        bounds={"supply.pressure": BOUNDS["supply.pressure"]},
    )  # fmt: skip
    return found_again.rms(model.sensed)


def verdict(fits: Sequence[DynamicFit]) -> str:
    """Where the sensor sat, as the residuals say it."""
    inside = min(f.rms("pressure") for f, m in zip(fits, MODELS, strict=True) if m.sensed == "pressure")
    before = min(f.rms("line.pressure") for f, m in zip(fits, MODELS, strict=True) if m.sensed == "line.pressure")
    if before < 0.7 * inside:
        return f"looks sensed before the muscle: {inside / 1e3:.2f} kPa inside, {before / 1e3:.2f} kPa in the line"
    return f"does not tell where it was sensed: {inside / 1e3:.2f} kPa inside, {before / 1e3:.2f} kPa in the line"


def main() -> None:
    """Print the table, the last variant's estimates and profiles, and what each fit says of the other records."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", type=pathlib.Path)
    parser.add_argument("--starts", type=int, default=8)
    options = parser.parse_args()
    files = [f for p in options.paths for f in (sorted(p.glob("*fill*.csv")) if p.is_dir() else [p])]
    begun, records, last = time.perf_counter(), [record(f) for f in files], []
    for path, found in zip(files, records, strict=True):
        fits = [fitted(model, found, options.starts) for model in MODELS]
        last.append(fits[-1])
        print(f"\n## {path.name}: {verdict(fits)}")
        for model, fit in zip(MODELS, fits, strict=True):
            print(f"{fit.rms(model.sensed) / 1e3:7.2f} kPa rms  {model.name}; {len(fit.estimates)} unknowns")
        print(f"\n{fits[-1]}\n")
        for name in ("valve.critical_ratio", "valve.conductance", "growth_volume", "lag"):
            if not fits[-1][name].on_bound:
                print(fits[-1].profile(name, 4))
    print("\n## One record's fit on another, rms [kPa]; only supply, start and start time are the other's own")
    for i, fit in enumerate(last):
        print(files[i].name, *(f"{predicted(fit, MODELS[-1], r) / 1e3:8.2f}" for r in records))
    print(f"{time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()
