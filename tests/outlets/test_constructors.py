"""Every public model refuses what it cannot use when it is constructed, with an error that names
class and field.

A value is either accepted, or refused by an AirmuscleError; no other exception occurs, whatever the
value.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import warnings
from typing import Any

import numpy as np
import pytest
from plants import EXAMPLES

from airmuscle import (
    bench,
    characteristic,
    control,
    core,
    design,
    engine,
    friction,
    geometry,
    load,
    outlets,
    physics,
    recording,
)
from airmuscle.control import PID
from airmuscle.errors import AirmuscleError, AirmuscleWarning, ParameterError, UnitError
from airmuscle.files import list_laws
from airmuscle.physics import HangingMass, Supply, Tank, Valve

FACES = (characteristic, control, engine, friction, geometry, physics)
MODELS = sorted(
    {
        thing
        for face in FACES
        for thing in (getattr(face, name) for name in face.__all__)
        if inspect.isclass(thing)
        and dataclasses.is_dataclass(thing)
        and not inspect.isabstract(thing)
    },
    key=lambda each: each.__name__,
)


class Unprintable:
    def __repr__(self) -> str:
        raise ZeroDivisionError


JUNK: tuple[Any, ...] = (
    None,
    "abc",
    "",
    "3 furlongs",
    math.nan,
    math.inf,
    -1,
    -1.0,
    10**400,
    10**5000,
    [],
    (),
    {},
    object(),
    True,
    int,
    ("a", None),
    (object(),),
    ([],),
    [math.nan],
    b"1",
    1j,
    lambda: 0,
    "9" * 100_000,
    Unprintable(),
    np.array("x"),
    ((object(),),),
)


def instances() -> dict[type[Any], Any]:
    """One instance of each model within the example plants and the library."""
    found: dict[type[Any], Any] = {}

    def collect(thing: Any) -> None:
        if isinstance(thing, tuple | list):
            for item in thing:
                collect(item)
        elif dataclasses.is_dataclass(thing) and not isinstance(thing, type):
            found.setdefault(type(thing), thing)
            for field in dataclasses.fields(thing):
                collect(getattr(thing, field.name))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        collect([*EXAMPLES.values(), *(load(name) for name in list_laws())])
    return found


INSTANCES = instances()


def refusal_of(construct: Any) -> str | None:
    """The message of the refusal, None if the value is accepted; an exception of another class is
    raised.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        try:
            construct()
        except AirmuscleError as error:
            return str(error)
    return None


@pytest.mark.parametrize("cls", MODELS, ids=lambda each: each.__name__)
def test_junk_in_one_field_is_refused_by_class_and_field(cls: type[Any]):
    if cls not in INSTANCES:
        pytest.skip("no example")
    for field in (f for f in dataclasses.fields(cls) if f.init):
        for junk in JUNK:
            said = refusal_of(
                lambda f=field, j=junk: dataclasses.replace(INSTANCES[cls], **{f.name: j})
            )
            if said is not None:
                assert cls.__name__ in said, (field.name, said)
                assert field.name.replace("_", " ") in said.replace("_", " "), said
                assert len(said) < 1000, said[:1000]


@pytest.mark.parametrize("cls", MODELS, ids=lambda each: each.__name__)
def test_junk_in_all_fields_is_refused(cls: type[Any]):
    names = [p.name for p in inspect.signature(cls).parameters.values()]
    for junk in JUNK:
        refusal_of(lambda j=junk: cls(**dict.fromkeys(names, j)))


def test_structural_fields_are_checked():
    valve = Valve(2.6e-9, 0.433)
    with pytest.raises(
        ParameterError, match="Tank: feed must be an instance of Orifice; it is None"
    ):
        Tank(Supply(6e5), None, 1e-3)  # type: ignore[arg-type]
    with pytest.raises(
        ParameterError, match="Tank: gas must be an instance of Gas; it is 'isothermal'"
    ):
        Tank(Supply(6e5), valve, 1e-3, "isothermal")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="SplitRange: positive must be a text; it is 3"):
        engine.SplitRange(3, "discharge")  # type: ignore[arg-type]
    with pytest.raises(
        ParameterError, match=r"HangingMass.mass .* is too large a number; allowed range"
    ):
        HangingMass(10**400)


def test_a_parameter_may_be_a_text_with_a_unit():
    assert HangingMass("10 kg") == HangingMass(10.0)  # type: ignore[arg-type]
    assert Supply("6 bar") == Supply(6e5)  # type: ignore[arg-type]
    with pytest.raises(
        UnitError, match=r"HangingMass.mass \(.*\): unit 'mm' cannot be converted to 'kg'"
    ):
        HangingMass("10 mm")  # type: ignore[arg-type]
    with pytest.raises(
        UnitError, match=r"Supply.pressure \(.*\): '6' has no unit; write it like '6 bar'"
    ):
        Supply("6")  # type: ignore[arg-type]


def test_references_and_limits_of_a_bench_are_checked():
    with pytest.raises(
        ParameterError, match="Reference: year must be an integer or None; it is '1999'"
    ):
        core.Reference("a1999", "A", "A title", "A journal", "1999")  # type: ignore[arg-type]
    area = characteristic.ValidityRange(0.0, 6e5, 0.0, 0.25)
    with pytest.raises(
        ParameterError, match="BenchLimits: validity_range must be an instance of ValidityRange"
    ):
        bench.BenchLimits(None, 1e3)  # type: ignore[arg-type]
    with pytest.raises(
        ParameterError, match=r"max_force=inf, .* needs finite forces, and min_force below"
    ):
        bench.BenchLimits(area, math.inf)


def test_a_supply_of_some_pascals_is_implausible():
    with pytest.warns(
        AirmuscleWarning,
        match=r"Supply.pressure .* is 6 Pa, .* implausibly small.* such as '6 bar'",
    ):
        Supply(6.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Supply(0.0).pressure == 0.0


def settings() -> list[Any]:
    """One instance of each dataclass that is a setting of a fit, a reader, a tuning, a benchmark or
    a learning task.
    """
    step = design.StepMotion(0.1, 0.0)
    plant = EXAMPLES["surface"]
    return [
        bench.Huber(1.0),
        bench.LeastSquares(),
        bench.BlockSplit(),
        bench.LevelSplit("pressure"),
        bench.Censoring(),
        bench.StartTime(0.1),
        bench.InitialValue("pressure", 1.0),
        bench.PlantUncertainty({"muscle.damping": 1.0}),
        bench.RecursiveFit(
            bench.BenchLimits(characteristic.ValidityRange(0.0, 6e5, 0.0, 0.25), 1e3)
        ),
        bench.BlockMeans(),
        bench.Decimation(),
        bench.RecordedTime(),
        bench.ColumnMapping(),
        recording.Recording({"time": [0.0, 1.0]}, "two rows"),
        outlets.ValueRange(("mass",), 0.0, 1.0),
        outlets.FactorRange(("mass",), 0.5, 2.0),
        outlets.Observation("angle", "rad", -1.0, 1.0),
        design.FirstOrderDeadTime(1.0, 1.0, 0.1),
        design.IntegratorDeadTime(1.0, 0.1),
        design.UltimatePoint(1.0, 1.0),
        design.Perturbations(),
        design.RobustObjective(),
        design.RootMeanSquareError(),
        design.RuleSettings("SIMC", 1, 1),
        design.IntegralAbsoluteError(),
        design.IntegralTimeAbsoluteError(),
        design.StuckValve("left.fill", 1.0, 0.5),
        design.ControlTask("step", step, 1.0),
        step,
        design.RampMotion(0.1, 0.0, 1.0),
        design.SineMotion(0.1, 1.0),
        design.MinimumJerkMotion(0.1, 0.0, 1.0),
        design.SumOfMotions((step, step)),
        control.ExtendedKalmanFilter(plant, ("pressure",), 0.01, {}, {"pressure": 500.0}),
        control.UnscentedKalmanFilter(plant, ("pressure",), 0.01, {}, {"pressure": 500.0}),
        engine.WithDrivers(engine.Schedule({"fill": ((0, 1),)}), {"fill": engine.PWM(50.0)}),
        engine.Schedule({"fill": ((0, 1),)}),
        design.Contender("PID", PID("angle", "difference", 1.0)),
    ]


@pytest.mark.parametrize("setting", settings(), ids=lambda each: type(each).__name__)
def test_junk_in_a_setting_is_accepted_or_refused_but_never_a_foreign_exception(setting: Any):
    for field in (f for f in dataclasses.fields(setting) if f.init):
        for junk in (*JUNK, np.array([1.0, 2.0]), {"a": {"b": 1}}):
            refusal_of(lambda f=field, j=junk: dataclasses.replace(setting, **{f.name: j}))
        said = refusal_of(lambda f=field: dataclasses.replace(setting, **{f.name: Unprintable()}))
        assert said is not None, field.name
        names = type(setting).__name__ in said and field.name in said
        assert names or isinstance(setting, engine.InputSignal), said


def test_the_mapping_of_a_row_reader_is_checked():
    for junk in (3, "time", [1], object()):
        with pytest.raises(ParameterError, match="RowReader: mapping must be a ColumnMapping"):
            bench.RowReader("log.csv", junk)  # type: ignore[arg-type]


def test_an_array_without_dimension_is_no_list_of_numbers():
    with pytest.raises(ParameterError, match=r"Lever.arms .* it must be several numbers"):
        dataclasses.replace(INSTANCES[physics.Lever], arms=np.array("x"))
