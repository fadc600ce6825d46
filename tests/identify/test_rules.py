"""Every rule of the tables of diagnosis fires on data that have what it names, and is silent on
clean data.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laboratories import (
    FORCE,
    LENGTH,
    MUSCLE,
    PRESSURE,
    RESTING_LENGTH,
    TIME,
    Table,
    ramps,
    sweeps,
    with_glitches,
)

import airmuscle
from airmuscle import read_csv
from airmuscle.bench import UNCENSORED, Huber, diagnose, fit, predict_static
from airmuscle.bench.diagnosis import RECORDING_RULES, DiagnosisRule
from airmuscle.bench.prediction import PREDICTION_RULES
from airmuscle.bench.statics import FIT_RULES, POINT_RULES, FitPoints, blank_surface
from airmuscle.errors import ParameterError
from airmuscle.physics import (
    Braid,
    ContractileSurface,
    LogarithmicLength,
    PooledLengthLaw,
    TonduLopez2000,
)
from airmuscle.recording import Recording

DATA = Path(airmuscle.__file__).parent / "files" / "library" / "data"
ATMOSPHERE = 101_325.0
THICKER = dataclasses.replace(MUSCLE, radius=0.0128)
FRICTIONLESS = dataclasses.replace(MUSCLE, friction=0.0)
TONDU = TonduLopez2000(Braid(0.0095, 0.42, 0.3), 1.3)
Recordings = tuple[Recording, ...]


def bench(tables: dict[str, Table], marker: str = "") -> Recordings:
    """The recordings of a laboratory in SI units."""
    recordings = []
    for name, table in tables.items():
        columns = {
            "time": table[TIME],
            "pressure": 1e3 * table[PRESSURE],
            "contraction": 1.0 - 1e-3 * table[LENGTH] / RESTING_LENGTH,
            "force": table[FORCE],
        }
        constants = {"resting_length": RESTING_LENGTH}
        recordings.append(Recording(columns, name + marker, constants))
    return tuple(recordings)


SWEEPS = bench(sweeps())
RAMPS = bench(ramps())


def with_column(
    recordings: Recordings, name: str, change: Callable[[np.ndarray], np.ndarray]
) -> Recordings:
    """The recordings with a changed column."""
    return tuple(run.with_columns(**{name: change(run[name])}) for run in recordings)


def with_length(recordings: Recordings, longer: float) -> Recordings:
    """The recordings with a length that is longer than that of the contraction [m]."""
    return tuple(
        run.with_columns(length=RESTING_LENGTH * (1.0 - run["contraction"]) + longer)
        for run in recordings
    )


def mixed_pressures() -> Recordings:
    """Every other ramp in absolute pressure."""
    return tuple(
        run.with_columns(pressure=run["pressure"] + (ATMOSPHERE if i % 2 else 0.0))
        for i, run in enumerate(RAMPS)
    )


def fill() -> Recordings:
    """A fill in absolute pressure, without force."""
    time = 0.1 * np.arange(200)
    pressure = ATMOSPHERE + 5e5 * (1.0 - np.exp(-time))
    columns = {"time": time, "pressure": pressure}
    return (Recording(columns, "fill", units={"pressure": "kPa"}),)


def coded(force: np.ndarray) -> np.ndarray:
    return np.where(np.arange(force.size) % 15 == 7, -999.0, force)


OF_RECORDINGS: dict[str, Callable[[], Recordings]] = {
    "codes of missing values that are read as numbers": lambda: with_column(SWEEPS, "force", coded),
    "pressures of which the lowest is the atmosphere": fill,
    "absolute and gauge pressures mixed": mixed_pressures,
    "isobars of absolute pressures": lambda: with_column(
        SWEEPS, "pressure", lambda pressure: pressure + ATMOSPHERE
    ),
    "a zero of the pressure": lambda: with_column(
        RAMPS, "pressure", lambda pressure: pressure - 2e4
    ),
    "a force of the wrong sign": lambda: with_column(SWEEPS, "force", np.negative),
    "a zero of the force": lambda: with_column(RAMPS, "force", lambda force: force + 40.0),
    "a contraction of the wrong sign, or percent as ratios": lambda: with_column(
        SWEEPS, "contraction", np.negative
    ),
    "a resting length that the rows contradict": lambda: with_column(
        SWEEPS, "contraction", lambda contraction: contraction - 0.15
    ),
    "a muscle that pulls where none is so short": lambda: with_column(
        SWEEPS, "contraction", lambda contraction: contraction + 0.35
    ),
    "a contraction that the length contradicts": lambda: with_length(SWEEPS, 0.02),
    "an elongation under pressure": lambda: with_column(
        SWEEPS, "contraction", lambda contraction: 0.24 - contraction
    ),
    "a pressure that no muscle bears": lambda: with_column(
        SWEEPS, "pressure", lambda pressure: 10.0 * pressure
    ),
    "a force that no bore explains": lambda: with_column(
        RAMPS, "pressure", lambda pressure: 0.01 * pressure
    ),
    "rows that contradict each other": lambda: RAMPS + bench(ramps(THICKER), " again"),
    "runs of two muscles": lambda: SWEEPS + bench(sweeps(THICKER), " again"),
    "outliers of the force": lambda: bench(with_glitches(sweeps(), 0.02, (200.0, 400.0))),
    "a pressure sensor at its limit": lambda: with_column(
        RAMPS, "pressure", lambda pressure: np.minimum(pressure, 4.5e5)
    ),
    "loops of a delay or of a filter of a sensor": lambda: bench(ramps(delay=0.3)),
}


def grid(rows: int = 8, noise: float = 1.0, high: float = 0.2, law: Any = TONDU) -> Recording:
    """Points of a muscle over pressures and contractions, without time."""
    pressure, contraction = (
        axis.ravel()
        for axis in np.meshgrid(np.linspace(1e5, 6e5, rows), np.linspace(0, high, rows))
    )
    force = law.force(pressure, contraction)
    force = force + noise * np.random.default_rng(3).standard_normal(force.size)
    return Recording({"pressure": pressure, "contraction": contraction, "force": force}, "grid")


def with_force(recording: Recording, rows: slice, force: float) -> Recording:
    values = recording["force"].copy()
    values[rows] = force
    return recording.with_columns(force=values)


def jumping() -> Recordings:
    """Staircases of the pressure at held lengths; the force is two rows later, and -1 N where the
    muscle is slack.
    """
    steps = np.concatenate([np.arange(0.0, 6e5, 5e4), np.arange(6e5, 0.0, -5e4)])
    pressure = np.repeat(steps, 8)
    earlier = np.concatenate([pressure[:2], pressure[:-2]])
    runs = []
    for held in (0.0, 0.05, 0.1, 0.15, 0.2):
        contraction = np.full(pressure.size, held)
        force = MUSCLE.force(earlier, contraction)
        noise = np.random.default_rng(0).standard_normal((2, force.size))
        columns = {
            "time": 0.05 * np.arange(pressure.size),
            "pressure": pressure + 200.0 * noise[0],
            "contraction": contraction,
            "force": np.where(force > 0.0, force + 0.2 * noise[1], -1.0),
        }
        constants = {"resting_length": RESTING_LENGTH}
        runs.append(Recording(columns, f"held {held}", constants))
    return tuple(runs)


OF_POINTS: dict[str, Callable[[], FitPoints]] = {
    "rows that another recording has already": lambda: FitPoints.from_recordings(
        [*SWEEPS, dataclasses.replace(SWEEPS[2], origin="copy")]
    ),
    "slack rows after a jump of the pressure": lambda: FitPoints.from_recordings(jumping()),
}


def different_rigs() -> list[Recording]:
    """Isobars of a fine rig, and of a coarse and noisy one."""
    runs = []
    for i, pressure in enumerate(np.linspace(1e5, 6e5, 8)):
        step = 12.0 if i % 2 else 0.2
        contraction = np.linspace(0.0, 0.2, 400)
        force = TONDU.force(np.full(400, pressure), contraction)
        force = force + 1.2 * step * np.random.default_rng(i).standard_normal(400)
        columns = {
            "time": 0.1 * np.arange(400),
            "pressure": np.full(400, pressure),
            "contraction": contraction,
            "force": step * np.round(force / step),
        }
        runs.append(Recording(columns, f"isobar {i}"))
    return runs


def specimens() -> list[Recording]:
    """Points of five muscles of one type whose force scatters."""
    runs = []
    for i, length in enumerate((0.1, 0.15, 0.2, 0.3, 0.4)):
        run = grid(6)
        force = run["force"] * (1.0 + 0.03 * (-1) ** i + 0.1 * np.log(length / 0.2))
        constants = {"resting_length": length, "specimen": f"muscle {i}"}
        runs.append(Recording({**run.columns, "force": force}, f"muscle {i}", constants))
    return runs


POOLED = PooledLengthLaw(
    LogarithmicLength(ContractileSurface.blank(3), ContractileSurface.blank(1), 0.2, 0.2),
    (ContractileSurface.blank(2),),
)
OF_FITS: dict[str, Callable[[], Any]] = {
    "rows with a missing value": lambda: fit(
        blank_surface(3, 1e4), with_force(grid(), slice(0, 2), np.nan)
    ),
    "rows that are bounds": lambda: fit(
        blank_surface(3, 1e4), with_force(grid(), slice(56, 60), 0.0)
    ),
    "rows above the greatest force of the law": lambda: fit(blank_surface(3, 500.0), grid()),
    "parameters that bounds alone determine": lambda: fit(
        ContractileSurface.blank(5, max_force=2000.0),
        read_csv(DATA / "dmsp-20-300.csv"),
    ),
    "measured values without force": lambda: fit(
        blank_surface(3, 1e4), with_force(grid(), slice(56, 60), 0.0), censoring=UNCENSORED
    ),
    "another resting length than that of the recording": lambda: fit(
        TonduLopez2000(Braid(0.0095, 0.5, 0.3), 1.1),
        grid().with_constants(resting_length=0.25),
        fixed=("geometry.radius",),
    ),
    "a parameter on its bound": lambda: fit(
        dataclasses.replace(TONDU, end_correction=1.2),
        grid(noise=1.0).with_columns(
            force=dataclasses.replace(TONDU, end_correction=1.0).force(
                grid()["pressure"], 0.9 * grid()["contraction"]
            )
        ),
        fixed=("geometry.radius",),
    ),
    "as many rows as parameters": lambda: fit(
        ContractileSurface.blank(1), grid().rows(np.array([0, 7, 56]))
    ),
    "an ill-conditioned problem": lambda: fit(TONDU, grid(high=0.0008, noise=0.0)),
    "a robust loss": lambda: fit(blank_surface(3, 1e4), grid(), loss=Huber(3.0)),
    "test rigs with different sensors": lambda: fit(blank_surface(4, 1e4), different_rigs()),
    "a scale of the loss below the noise": lambda: fit(
        blank_surface(3, 1e4), grid(), loss=Huber(0.1)
    ),
    "branches of the residuals": lambda: fit(blank_surface(4, 1e4), SWEEPS),
    "a quantity measured at one level": lambda: fit(
        TonduLopez2000(Braid(0.0095, 0.5, 0.3), 1.1),
        SWEEPS[3:4],
        fixed=("geometry.radius", "end_correction"),
    ),
    "effects of the specimens": lambda: fit(POOLED, specimens()),
    "a law that does not follow the data": lambda: fit(
        blank_surface(1, 1e4), bench(sweeps(FRICTIONLESS))
    ),
}


def held(law: Any, scale: float = 1.0) -> Any:
    """The prediction of a sweep whose force is multiplied, with a band of 5 N."""
    run = bench(sweeps(FRICTIONLESS))[3]
    return predict_static(law, run.with_columns(force=scale * run["force"]), half_width=5.0)


def fitted_law() -> Any:
    runs = [run.rows(run["force"] > 20.0) for run in bench(sweeps(FRICTIONLESS))]
    return fit(blank_surface(5, 1e4), runs).model


OF_PREDICTIONS: dict[str, Callable[[], Any]] = {
    "a law that does not follow the record": lambda: held(fitted_law(), 1.3),
    "a band that does not hold": lambda: held(fitted_law(), 1.3),
}


def rule_names(rules: tuple[DiagnosisRule, ...]) -> list[str]:
    return [rule.name for rule in rules]


CLEAN = {
    "recordings": lambda: bench(sweeps(FRICTIONLESS)),
    "points": lambda: FitPoints.from_recordings(bench(sweeps(FRICTIONLESS))),
    "a fit": lambda: fit(
        blank_surface(5, 1e4),
        [run.rows(run["force"] > 20.0) for run in bench(sweeps(FRICTIONLESS))],
    ),
    "a prediction": lambda: held(fitted_law()),
}


def test_every_rule_has_a_data_set():
    assert rule_names(RECORDING_RULES) == list(OF_RECORDINGS)
    assert rule_names(POINT_RULES) == list(OF_POINTS)
    assert rule_names(FIT_RULES) == list(OF_FITS)
    assert rule_names(PREDICTION_RULES) == list(OF_PREDICTIONS)


@pytest.mark.parametrize(
    ("name", "make"),
    [
        *OF_RECORDINGS.items(),
        *OF_POINTS.items(),
        *OF_FITS.items(),
        *OF_PREDICTIONS.items(),
    ],
)
def test_a_rule_fires_where_the_data_have_what_it_names(name: str, make: Callable[[], Any]):
    texts = [diagnosis.text for diagnosis in diagnose(make()) if diagnosis.rule == name]
    assert texts
    assert all(len(str(text)) > 20 for text in texts)


@pytest.mark.parametrize("make", CLEAN.values(), ids=CLEAN)
def test_no_rule_fires_on_clean_data(make: Callable[[], Any]):
    assert diagnose(make()) == ()


def test_a_rule_states_a_remedy_as_an_imperative():
    for rule in (*RECORDING_RULES, *POINT_RULES, *FIT_RULES, *PREDICTION_RULES):
        assert rule.remedy[0].islower(), rule.name
        assert not rule.remedy.endswith("."), rule.name


def test_what_has_no_rules_is_refused_with_what_has_them():
    with pytest.raises(
        ParameterError, match="Give recordings, the check of a record, the points of a fit, a fit"
    ):
        diagnose(3.0)
