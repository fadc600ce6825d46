"""Dynamic identification from fill records of an unloaded muscle: gas law, volume growth, supply
tube.

./run python benchmarks/real_fills.py FOLDER_OR_FILES...   (CSV with time and pressure; a record is
                                                           one fill)
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import pathlib
import time

import numpy as np

import airmuscle as am
from airmuscle.bench import (
    DynamicFit,
    Experiment,
    InitialConditions,
    InitialValue,
    StartTime,
    fit_dynamic,
    fit_tube,
    locate_pressure_sensor,
)

SENSOR = 500.0
"""Standard deviation of a measured pressure [Pa], close to that at the end of the records;
chosen.
"""
END = 5.0
"""Rows after this time [s] are at rest and are omitted; chosen."""
REST_VOLUME = 1e-4
"""Assumed volume at rest [m3], which is not known; conductances and volumes are relative to it."""
OPEN = am.Schedule({"fill": ((0.0, 1.0),)})
BOUNDS = {
    "supply.pressure": (590e3, 660e3),
    "fill.critical_ratio": (0.1, 0.6),
    "growth_volume": (0.0, 2 * REST_VOLUME),
    "midpoint_pressure": (0.0, 600e3),
    "pressure_width": (1e4, 3e5),
    "time_constant": (0.01, 5.0),
    "feed.conductance": (1e-10, 1e-7),
    "supply.volume": (1e-6, 5e-2),
}
"""Physical bounds (chosen): supply about 620 kPa, critical ratio 0.1 to 0.6, volume at most three
times rest volume.
"""
DROOPING = am.physics.Tank(am.Supply(630e3), am.Valve(3e-9, 0.3), 5 * REST_VOLUME)
"""The air line before the valve: a volume that is fed from the building, so that its pressure
sinks; initial guess.
"""


@dataclasses.dataclass(frozen=True)
class Model:
    """A model variant: plant with initial values, free parameters, and location of the pressure
    sensor.
    """

    name: str
    plant: am.Plant
    free: tuple[str, ...]
    sensor: str = "pressure"

    @property
    def supply(self) -> str:
        """Path of the supply's pressure."""
        return f"{self.valves}{'supply.' * self.droops}supply.pressure"

    @property
    def droops(self) -> bool:
        """Whether the supply has a volume."""
        return any(path.endswith("supply.volume") for path in self.free)

    @property
    def valves(self) -> str:
        """Common prefix of the valve paths."""
        return (
            "circuit.circuit."
            if isinstance(self.plant.circuit, am.physics.WithTubes)
            else "circuit."
        )

    def nuisances(self, wall: bool) -> tuple[str | StartTime | InitialValue, ...]:
        """Nuisance parameters of each record; with the initial wall volume if `wall`."""
        names = (StartTime(0.012), InitialValue("pressure", 3e3), self.supply)
        return (*names, InitialValue("wall_volume", 1e-5)) if wall else names

    def bounds(self) -> dict[str, tuple[float, float]]:
        """Physical bounds of the free parameters."""
        named = (*self.free, self.supply)
        return {path: pair for end, pair in BOUNDS.items() for path in named if path.endswith(end)}


def make_plant(
    gas: am.physics.Gas, growth: float, lag: float, line: bool, supply: am.physics.AirSource
) -> am.Plant:
    """An unloaded muscle of unknown length behind a valve, with a supply tube if `line`, in which
    air does not heat if the gas model is that of a chamber."""
    muscle = dataclasses.replace(
        am.Muscle.ideal(am.geometry.Vessel(REST_VOLUME)),
        wall=am.physics.SwellingWall(growth, 150e3, 5e4, lag),
    )
    tube_gas = (
        am.Isothermal() if isinstance(gas, am.physics.WallHeatTransfer) and lag > 0.1 else gas
    )
    valves = am.FillDischarge(supply, am.Valve(5e-10, 0.4), am.Valve(0.0, 0.3))
    circuit = (
        am.physics.WithTubes(valves, am.physics.Tube(am.Valve(1.3e-9, 0.3), 2e-5, gas=tube_gas))
        if line
        else valves
    )
    return am.Plant(muscle, circuit, am.Isometric(0.0), gas)


def make_model(
    name: str,
    gas: am.physics.Gas,
    *,
    growing: bool = False,
    lagging: bool = False,
    line: bool = False,
    drooping: bool = False,
) -> Model:
    """A model variant with the given features."""
    valves = "circuit.circuit." if line else "circuit."
    free = [f"{valves}fill.conductance", f"{valves}fill.critical_ratio"]
    free += ["circuit.tube.volume", "circuit.tube.orifice.conductance"] if line else []
    free += (
        [f"muscle.wall.{part}" for part in ("growth_volume", "midpoint_pressure", "pressure_width")]
        if growing
        else []
    )
    free += ["muscle.wall.time_constant"] if lagging else []
    free += [f"{valves}supply.feed.conductance", f"{valves}supply.volume"] if drooping else []
    supply = DROOPING if drooping else am.Supply(625e3)
    start = make_plant(
        gas, REST_VOLUME if growing else 0.0, 0.2 if lagging else 0.005, line, supply
    )
    return Model(name, start, tuple(free), "tube.pressure" if line else "pressure")


MODELS = (
    make_model("isothermal, constant volume", am.Isothermal()),
    make_model("polytropic 1.2, growing volume", am.Polytropic(1.2), growing=True),
    make_model(
        "polytropic 1.2, growing volume with lag", am.Polytropic(1.2), growing=True, lagging=True
    ),
    make_model("tube, constant volume, sensor in the tube", am.Polytropic(1.2), line=True),
    make_model(
        "tube, growing volume with lag, sensor in the tube",
        am.Polytropic(1.2),
        growing=True,
        lagging=True,
        line=True,
    ),
    make_model(
        "tube, growing volume with lag, air that cools, supply with a volume",
        am.physics.WallHeatTransfer(25.0),
        growing=True,
        lagging=True,
        line=True,
        drooping=True,
    ),
)

GASES = (
    am.Isothermal(),
    am.Polytropic(1.2),
    *(am.physics.WallHeatTransfer(h) for h in (12.5, 25.0, 50.0)),
)
"""Gas models that are compared with the same unknowns, the default with half and twice its
coefficient, too.
"""


def read_record(path: pathlib.Path) -> am.Recording:
    """The transient part of a record; its pressure is given the names of all sensor locations."""
    recording = am.read_csv(path)
    recording = recording.rows(recording["time"] < END)
    return recording.with_columns(
        **dict.fromkeys(("tube.pressure", "tube1.pressure"), recording["pressure"])
    )


def noise_floor(recording: am.Recording, width: int = 11) -> tuple[float, float]:
    """Rms deviation [Pa] from a cubic through each `width` successive rows after 0.1 s, and the rms
    error [Pa] that the resolution of the recorded times, 1 ms, gives with the slope of the
    pressure, as an even distribution.
    """
    time = recording["time"]
    pressure = recording["pressure"]
    squares = []
    for first in range(int(np.searchsorted(time, 0.1)), len(time) - width):
        rows = slice(first, first + width)
        powers = np.vander(time[rows] - time[first], 4)
        residual = pressure[rows] - powers @ np.linalg.lstsq(powers, pressure[rows], rcond=None)[0]
        squares.append(float(residual @ residual) / (width - 4))
    slope = np.gradient(pressure, time)
    return float(np.sqrt(np.mean(squares))), float(np.sqrt(np.mean(slope**2) / 12)) * 1e-3


def sensor_noise(recording: am.Recording, begin: float, end: float) -> list[float]:
    """Standard deviation [Pa] about a straight line between two times [s], and of the differences
    of second, third and fourth order, divided by the root of the sum of their squared binomial
    coefficients: white noise gives one value.
    """
    rows = (recording["time"] >= begin) & (recording["time"] < end)
    time = recording["time"][rows]
    pressure = recording["pressure"][rows]
    line = np.polyval(np.polyfit(time, pressure, 1), time)
    differences = [
        np.diff(pressure, order) / np.sqrt(math.comb(2 * order, order)) for order in (2, 3, 4)
    ]
    return [float(np.std(each)) for each in (pressure - line, *differences)]


def make_experiment(
    start_plant: am.Plant, recording: am.Recording, wall: bool = False
) -> Experiment:
    """The fill as an experiment that starts at the first row that differs from the initial
    pressure.
    """
    pressure = recording["pressure"]
    first = float(np.median(recording["pressure"][:2]))
    begin = float(recording["time"][max(int(np.argmax(pressure > first + 5e3)) - 1, 0)])
    start = InitialConditions.at_coordinates(start_plant, first)
    if wall:  # given explicitly, so that it can be estimated
        known = {**start.known, "wall_volume": start.guess["wall_volume"]}
        stationary = tuple(name for name in start.stationary if name != "wall_volume")
        start = dataclasses.replace(start, known=known, stationary=stationary)
    return Experiment(recording, OPEN, start, begin)


def fit_record(variant: Model, recording: am.Recording, starts: int) -> DynamicFit:
    """The variant fitted to one record; nuisance parameters are initial pressure, start time and
    supply pressure.
    """
    return fit_dynamic(
        variant.plant,
        [make_experiment(variant.plant, recording)],
        free=variant.free,
        observed={variant.sensor: SENSOR},
        bounds=variant.bounds(),
        per_record=variant.nuisances(False),
        starts=starts,
    )


def fit_divided(recording: am.Recording, starts: int) -> tuple[Model, DynamicFit]:
    """The last plant with the number of segments of its tube by AICc, and its fit."""
    last = MODELS[-1]

    def fitted(plant: am.Plant, sensor: str) -> DynamicFit:
        return fit_record(dataclasses.replace(last, plant=plant, sensor=sensor), recording, starts)

    fit = fit_tube(last.plant, fitted)
    model = fit.problem.record_models[0]
    return dataclasses.replace(last, plant=model.plant, sensor=model.names[0]), fit


def prediction_rms(fit: DynamicFit, variant: Model, recording: am.Recording, wall: bool) -> float:
    """Rms error [Pa] of the prediction of another record, for which only the nuisance parameters
    are fitted.
    """
    plant = fit.plant()
    assert isinstance(plant, am.Plant)
    prediction = fit_dynamic(
        plant,
        [make_experiment(plant, recording, wall)],
        free=(),
        per_record=variant.nuisances(wall),
        observed={variant.sensor: SENSOR},
        bounds={variant.supply: BOUNDS["supply.pressure"]},
    )
    return prediction.rms(variant.sensor)


def show_record(name: str, models: list[Model], fits: list[DynamicFit]) -> None:
    """Print the residuals of all variants, and estimates and profiles of the last one."""
    inside = min(
        (
            f
            for f, m in zip(fits, models, strict=True)
            if m.sensor == "pressure" and "lag" not in m.name
        ),
        key=lambda f: f.rms("pressure"),
    )
    print(f"\n## {name}: {locate_pressure_sensor(in_muscle=inside, in_line=fits[-1])}")
    for variant, fit in zip(models, fits, strict=True):
        bound = [e.name for e in fit.estimates if e.on_bound]
        note = f"; on bounds: {', '.join(bound)}" if bound else ""
        print(
            f"{fit.rms(variant.sensor) / 1e3:7.2f} kPa rms  {variant.name}; {len(fit.estimates)}"
            f" unknowns{note}"
        )
    print(f"\n{fits[-1]}\n")
    for path in (
        "circuit.circuit.fill.critical_ratio",
        "circuit.circuit.fill.conductance",
        "muscle.wall.growth_volume",
        "circuit.tube.volume",
        "muscle.wall.time_constant",
        "circuit.circuit.supply.feed.conductance",
        "circuit.circuit.supply.volume",
    ):
        if not fits[-1][path].on_bound:
            print(fits[-1].profile(path, 4))


def compare_gases(records: list[am.Recording], starts: int) -> None:
    """Print the rms errors of the gas models, for which nothing of the gas is fitted."""
    print(
        "\n## Gas models, rms error of each record [kPa]: constant volume, growing volume, tube and"
        " constant volume"
    )
    for gas in GASES:
        variants = (
            make_model("", gas),
            make_model("", gas, growing=True),
            make_model("", gas, line=True),
        )
        errors = [[fit_record(v, r, starts).rms(v.sensor) / 1e3 for r in records] for v in variants]
        print(f"{gas!s:35}", " | ".join(" ".join(f"{e:6.2f}" for e in each) for each in errors))


def main() -> None:
    """Print the results of each record, and the prediction errors of each fit on the other
    records.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paths", nargs="+", type=pathlib.Path)
    parser.add_argument("--starts", type=int, default=10)
    options = parser.parse_args()
    files = [
        f for p in options.paths for f in (sorted(p.glob("*fill*.csv")) if p.is_dir() else [p])
    ]
    start = time.perf_counter()
    records = [read_record(f) for f in files]
    last = []
    for path, recording in zip(files, records, strict=True):
        fits = [fit_record(variant, recording, options.starts) for variant in MODELS[:-1]]
        model, fit = fit_divided(recording, options.starts)
        last.append((model, fit))
        show_record(path.name, [*MODELS[:-1], model], [*fits, fit])
        print(f"segments of the tube: {model.plant.circuit.tube.segment_count}")
        noise, timing = noise_floor(recording)
        later = fit.residuals()[model.sensor][recording["time"] >= 0.1]
        for begin, end in ((0.1, END), (2.0 * END, 6.0 * END)):
            if am.read_csv(path)["time"][-1] > end - 0.1:
                found = ", ".join(
                    f"{each / 1e3:.2f}" for each in sensor_noise(am.read_csv(path), begin, end)
                )
                print(
                    f"{begin:g} to {end:g} s: deviation from a line, differences of order 2, 3, 4:"
                    f" {found} kPa"
                )
        print(
            f"noise {noise / 1e3:.2f} kPa, by resolution of the times {timing / 1e3:.2f} kPa;"
            f" residual of the last plant after 0.1 s {np.sqrt(np.mean(later**2)) / 1e3:.2f} kPa"
        )
    for wall in (False, True):
        refitted = "supply pressure, initial pressure and start time" + (
            " and initial wall volume" if wall else ""
        )
        print(f"\n## Prediction of other records, rms error [kPa]; only {refitted} are fitted")
        for i, (model, fit) in enumerate(last):
            print(
                files[i].name,
                *(f"{prediction_rms(fit, model, r, wall) / 1e3:8.2f}" for r in records),
            )
    compare_gases(records, options.starts)
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
