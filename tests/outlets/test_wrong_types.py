"""What is of the wrong type, in Python, is refused in one sentence of airmuscle's own, not by a
TypeError deep inside.

A text with a unit where a number is due, a name where a model is due, parts in the wrong order, a
list for a tuple.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airmuscle import cite, fit, load, load_data, read, read_csv, save, write
from airmuscle.engine import (
    PWM,
    Periodic,
    SampledSignal,
    Schedule,
    WithDrivers,
    advance,
    simulate,
    spline_trajectory,
)
from airmuscle.engine.run import integrators
from airmuscle.errors import (
    AirmuscleError,
    ColumnError,
    FileError,
    ParameterError,
    UnknownNameError,
)
from airmuscle.physics import (
    ContractileSurface,
    FillDischarge,
    HangingMass,
    LinearDamper,
    Muscle,
    Plant,
    Supply,
    Valve,
    WithOffsets,
    in_parallel,
    in_series,
)
from airmuscle.recording import Recording

EDGE = Valve(2.6e-9, 0.433)
CIRCUIT = FillDischarge(Supply(6e5), EDGE, EDGE)
MASS = HangingMass(10.0)
ENTRY = load("dmsp-20-300")
MUSCLE = replace(ENTRY.muscle, damper=LinearDamper(200.0))
PLANT = Plant(MUSCLE, CIRCUIT, MASS)
FILL = Schedule({"fill": ((0.1, 1.0),)})
REST = PLANT.state_at(pressure=1e5)
RUN = Recording({"time": np.array([0.0, 1.0]), "fill": np.array([0.0, 1.0])}, "a bench")


def ramp(time):
    return time


def sampled(function, **more):
    return SampledSignal.sampled({"fill": function}, **{"duration": 1.0, **more})


CASES = {
    "period as text": (
        lambda: Periodic(FILL, "1 s"),
        "Periodic.period is '1 s'; it must be one number",
    ),
    "no period": (lambda: Periodic(FILL, None), "Periodic.period is None; it must be one number"),
    "several periods": (
        lambda: Periodic(FILL, np.ones(2)),
        r"Periodic.period is array.*; it must be one number",
    ),
    "periodic mapping": (
        lambda: Periodic({"fill": ((0, 1),)}, 1.0),
        "the input is {.*}; give a Schedule",
    ),
    "driven mapping": (
        lambda: WithDrivers({"fill": 1}, {"fill": PWM(9.0)}),
        "the input is {.*}; give a Schedule",
    ),
    "no drivers": (lambda: WithDrivers(FILL, None), "the drivers are None; name the inputs"),
    "sampled number": (
        lambda: sampled(0.5),
        "the sampled signal of 'fill' is 0.5; give a function of time",
    ),
    "sampled text": (
        lambda: sampled(lambda t: "a"),
        "the sampled signal of 'fill' at 0 s is 'a'; it must be one number",
    ),
    "sampled columns": (
        lambda: sampled(lambda t: np.ones(2)),
        "the sampled signal of 'fill' at 0 s is array",
    ),
    "sampled nan": (
        lambda: sampled(lambda t: math.nan if t > 0.4 else 0.0),
        "'fill' is nan at 0.40.* must be finite",
    ),
    "sampled complex": (
        lambda: sampled(lambda t: 1j),
        "the sampled signal of 'fill' at 0 s is 1j; it must be one number",
    ),
    "sampled alone": (
        lambda: SampledSignal.sampled(ramp, duration=1.0),
        "a sampled signal is <function .*; name the inputs",
    ),
    "sampled duration": (
        lambda: sampled(ramp, duration="1 s"),
        "Signal.sampled: duration is '1 s'; it must be one",
    ),
    "sampled start": (
        lambda: sampled(ramp, start="0 s"),
        "Signal.sampled: start is '0 s'; it must be one number",
    ),
    "sampled error": (
        lambda: sampled(ramp, error="small"),
        "Signal.sampled: error is 'small'; it must be one number",
    ),
    "recorded mapping": (
        lambda: SampledSignal.recorded({"time": [1]}, {"fill": "fill"}),
        "is no Recording; give what read",
    ),
    "recorded list": (
        lambda: SampledSignal.recorded(RUN, ["fill"]),
        r"a recorded signal is \['fill'\]; name the inputs",
    ),
    "complex value": (lambda: Schedule({"fill": ((0, 1j),)}), "write pairs of time"),
    "array time": (lambda: Schedule({"fill": ((np.ones(2), 1),)}), "write pairs of time"),
    "array value": (lambda: SampledSignal({"fill": ((0, np.ones(2)),)}), "write pairs of time"),
    "input by number": (
        lambda: simulate(PLANT, Schedule({1: ((0, 1),)}), duration=0.1),
        "the plant has no input '1'",
    ),
    "pressure as bytes": (
        lambda: PLANT.state_at(pressure=b"1 bar"),
        "pressure of a state is b'1 bar'; it must be one",
    ),
    "no pressure": (
        lambda: PLANT.state_at(pressure=None),
        "pressure of a state is None; it must be one number",
    ),
    "pressure in a list": (
        lambda: PLANT.state_at(pressure=[[1e5]]),
        r"is \[100000.0\]; it must be one number",
    ),
    "pressure in a tuple": (
        lambda: PLANT.state_at(pressure=(b"1 bar",)),
        "is b'1 bar'; it must be one number",
    ),
    "endless pressure": (
        lambda: PLANT.state_at(pressure=math.inf),
        "pressure of a state is inf; it must be finite",
    ),
    "position as bytes": (
        lambda: PLANT.state_at(pressure=0.0, position=b"10 mm"),
        "the position of a state is b'10 mm'",
    ),
    "speed nan": (
        lambda: PLANT.state_at(pressure=0.0, speed=math.nan),
        "the speed of a state is nan; it must be finite",
    ),
    "name of a muscle": (lambda: replace(MUSCLE, name=5), "Muscle: name must be a text; it is 5"),
    "empty name": (
        lambda: replace(MUSCLE, name=""),
        "Muscle: name is ''; it must be a non-empty text",
    ),
    "validity range of a muscle": (
        lambda: replace(MUSCLE, validity_range="all"),
        "Muscle: validity_range must be an instance of ValidityRange or None; it is 'all'",
    ),
    "geometry first": (
        lambda: Muscle(MUSCLE.geometry, MUSCLE.contractile),
        "Muscle: contractile must be an instance of Characteristic; it is ",
    ),
    "list of muscles": (
        lambda: Plant([MUSCLE], CIRCUIT, MASS),
        "its muscle must be a Muscle; .*into a tuple",
    ),
    "library entry": (
        lambda: Plant(ENTRY, CIRCUIT, MASS),
        "its muscle must be a Muscle; .* give its .muscle",
    ),
    "no muscle": (
        lambda: Plant((), (), MASS),
        "Plant: it has no muscle; give one, or a tuple of them",
    ),
    "parts in disorder": (
        lambda: Plant(MUSCLE, MASS, CIRCUIT),
        "its mechanism must be a Mechanism; it is FillDisch",
    ),
    "a class": (
        lambda: Plant(MUSCLE, CIRCUIT, HangingMass),
        "its mechanism must be a Mechanism; it is <class",
    ),
    "supply as number": (
        lambda: Plant(MUSCLE, FillDischarge(6e5, EDGE, EDGE), MASS),
        "FillDischarge: supply must be an instance of AirSource; it is 600000",
    ),
    "one for several": (
        lambda: WithOffsets(MASS, 0.1),
        r"WithOffsets.offsets .* is 0.1; it must be several numbers, such as \(1.0",
    ),
    "valve as number": (
        lambda: in_series(EDGE, 2.0),
        "argument 2 is float; it must be a Valve, with C and b",
    ),
    "no valve": (in_parallel, "in_parallel: no valve is given; give at least one"),
    "muscle simulated": (
        lambda: simulate(MUSCLE, FILL, duration=0.1),
        "simulate: Muscle.* is no plant; give Plant",
    ),
    "class simulated": (
        lambda: simulate(Plant, FILL, duration=0.1),
        "simulate: <class .* is no plant",
    ),
    "muscle advanced": (
        lambda: advance(MUSCLE, REST, {}, 0.1),
        "advance: Muscle.* is no plant; give Plant",
    ),
    "advanced from": (
        lambda: advance(PLANT, REST, {}, 0.1, start_time="0 s"),
        "advance: start_time is '0 s'; it must",
    ),
    "method as class": (
        lambda: simulate(PLANT, FILL, duration=0.1, integrator=integrators.Rodas4),
        "the integrator is <class",
    ),
    "times as text": (
        lambda: simulate(PLANT, FILL, duration=0.1, output_times=["a"]),
        r"output_times is \['a'\]; give a spacing",
    ),
    "motion as text": (
        lambda: spline_trajectory("a", "b"),
        "spline_trajectory: 'a' and 'b' are not times",
    ),
    "sources of a name": (
        lambda: cite("dmsp-20-300"),
        r"cite: 'dmsp-20-300' is not a model; .*cite\(load\(",
    ),
    "fit of a name": (lambda: fit("Sarosi2012", RUN), "fit: Sarosi2012 is not a characteristic"),
    "fit of a class": (
        lambda: fit(ContractileSurface, RUN),
        (
            r"fit: the class ContractileSurface is not a characteristic\. Give one, for example an"
            r" object of the class, ContractileSurface\.blank\(degree=5\)\."
        ),
    ),
    "fit to a file": (
        lambda: fit(MUSCLE.contractile, "run.csv"),
        "fit: run.csv is not a Recording",
    ),
    "fit to nothing": (
        lambda: fit(MUSCLE.contractile, None),
        "fit: None is not a Recording. Give one, as returned by read",
    ),
    "save a plant": (
        lambda: save(PLANT, "muscle.toml"),
        "save: Plant.* is no muscle, characteristic, fit or entry of the library.*save_scenario",
    ),
    "write a plant": (lambda: write(PLANT, "run.csv"), "write: Plant.* is not a Recording"),
}


@pytest.mark.parametrize(("wrong", "message"), CASES.values(), ids=CASES.keys())
def test_a_wrong_type_is_refused_in_words(wrong, message, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ParameterError, match=message):
        wrong()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("wrong", "error", "message"),
    [
        (lambda: read_csv(5), FileError, "read_csv: 5 is not a path"),
        (lambda: read(None), FileError, "read: None is not a path. Pass a file, a folder"),
        (lambda: write(RUN, None), FileError, "write: None is not a path"),
        (lambda: save(ENTRY, None), FileError, "save: None is not a path"),
        (lambda: load_data(5), UnknownNameError, "no data set '5'; there are"),
        (lambda: RUN[3], ColumnError, "a bench: no column '3'; the columns are time, fill"),
        (lambda: SampledSignal.recorded(RUN, {"fill": 3}), ColumnError, "a bench: no column '3'"),
    ],
)
def test_what_is_no_path_or_name_is_refused_in_words(wrong, error, message):
    with pytest.raises(error, match=message):
        wrong()


def test_an_error_of_the_function_that_is_sampled_is_its_own():
    """It is the user's program, and its traceback shows the line."""
    with pytest.raises(ZeroDivisionError) as found:
        sampled(lambda t: 1 / t)
    assert not isinstance(found.value, AirmuscleError)
