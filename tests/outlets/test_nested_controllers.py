"""Scenario files hold every control law, with laws, sensors and models inside it, and are written
back unchanged.
"""

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from joint_models import proportional_joint
from scenario_files import writer_of

from airmuscle.control import (
    PID,
    AngleAndStiffness,
    AntagonisticInverse,
    Cascade,
    CoContraction,
    ComputedTorque,
    DeadZoneController,
    Decentralised,
    FrictionFeedForward,
    GainSchedule,
    HysteresisCompensation,
    HysteresisOperator,
    MotionFeedForward,
    Multirate,
    OnOffController,
    PredictiveControl,
    ProportionalFeedback,
    RepetitiveControl,
    SetpointCommand,
    SetpointLead,
    SlidingMode,
    SmithPredictor,
    StateFeedback,
    StaticFeedForward,
    StaticInverse,
    SuperTwisting,
    WithCommandDelay,
    WithFeedForward,
    WithFilter,
    WithManual,
    WithRateLimit,
    WithSetpointDelay,
    WithStuckValve,
)
from airmuscle.design import load_scenario_loop, scenario_contender
from airmuscle.engine import (
    ColumnSensor,
    Controller,
    ControlLoop,
    Periodic,
    Problem,
    SampledSignal,
    Schedule,
    SigmaDelta,
    SolenoidDriver,
    SplitRange,
    WithSensors,
)
from airmuscle.errors import AirmuscleError, ParameterError, UnitError, UnknownNameError
from airmuscle.files import Scenario, load_scenario, save_scenario, scenario_text
from airmuscle.files.library import model_class, model_names

EXAMPLE = Path(__file__).parents[2] / "examples" / "joint_cascade.toml"
TEXT = EXAMPLE.read_text(encoding="utf-8")
written = writer_of(TEXT)
DEGREE = math.pi / 180.0
BAR = 1e5
SIDES = ("left", "right")
SETPOINTS, PRESSURES = (
    tuple(f"{side}.{name}" for side in SIDES) for name in ("setpoint", "pressure")
)


@pytest.fixture(scope="module")
def regulated() -> Scenario:
    return load_scenario("joint-dmsp-20-regulators")


@pytest.fixture(scope="module")
def laws(regulated: Scenario) -> dict[str, Controller]:
    """A law of each class, with the regulators of the joint as inputs."""
    plant = regulated.plant
    first, second = SETPOINTS
    inverse = AntagonisticInverse(plant.muscles, plant.mechanism, 1e4, 5e5, steps=2)
    pid = PID("angle", first, 3e5, 0.2)
    both = Decentralised((PID("angle", first, 3e5), PID("angle", second, -3e5)))
    matrices = (
        (1.0, 0.0, 0.0, 1.0),
        (0.0, 1.0),
        (1.0, 0.0),
        (0.1, 0.2),
        (1e4, 2e4),
        (3e4,),
        (0.0,),
        (2e5,),
    )
    found = (
        pid,
        both,
        OnOffController("angle", first, 0.01),
        SlidingMode("angle", first, 1e5, 0.1, 0.05),
        DeadZoneController("angle", SplitRange(first, second), 0.01),
        SuperTwisting("angle", first, 1e4, 1e5, 0.05),
        CoContraction(SETPOINTS, 2e5),
        AngleAndStiffness(inverse, SETPOINTS, 20.0, 0.3),
        ComputedTorque(inverse, SETPOINTS, 30.0),
        StateFeedback(("angle",), ("angle",), (first,), ("angle", "speed"), *matrices),
        StaticFeedForward(StaticInverse(plant.muscles[0]), first, 0.3),
        SetpointCommand((first,), ("wanted",)),
        SetpointLead("wanted", "wanted_rate", first, 0.02),
        FrictionFeedForward("angular_speed", first, 5e3, 0.1),
        MotionFeedForward("angular_speed", "angular_acceleration", first, 2e3, -200.0),
        ProportionalFeedback(PRESSURES, SETPOINTS, 0.5),
        SigmaDelta(both),
        WithStuckValve(pid, first, 1.0, 0.5),
        WithSetpointDelay(pid, 3),
        WithFeedForward(CoContraction(SETPOINTS, 2e5), pid),
        WithSensors(pid, (ColumnSensor("angle", 1e-3, 2e-4, 3e-3, 2),), seed=7.0),
        Cascade(
            PID("angle", "difference", 2e5), CoContraction(SETPOINTS, 2e5), (-1.5e5,), (1.5e5,)
        ),
        GainSchedule(pid, "gain", "angular_speed", (0.0, 1.0), (2e5, 3e5)),
        HysteresisCompensation(pid, first, HysteresisOperator((0.0, 1e4), (1.0, 0.5)).inverse),
        Multirate(pid, 4),
        WithCommandDelay(pid, 2, 1, 0.1, 3.0),
        WithRateLimit(pid, (1e6,)),
        WithManual(pid, 0.3),
        WithFilter.notch(pid, "angle", 5.0),
        SmithPredictor(pid, "angle", first, 3, 2e-6, 0.1),
        RepetitiveControl(pid, "angle", 20, 2),
        PredictiveControl(
            plant,
            ("angle",),
            ("angle",),
            SETPOINTS,
            ("angular_speed",),
            ("angle", *SETPOINTS),
            ("angular_speed", "angular_speed.disturbance"),
            (2.5e5, 2.5e5),
            (2.5e5, 2.5e5),
            (0.02, 1e5, 1e5),
            (0.1, 5.0),
            (1e-4,),
            5e-3,
            horizon=4,
        ),
    )
    return {type(law).__name__: law for law in found}


def with_law(base: Scenario, law: Controller) -> Scenario:
    """The scenario of a joint with regulators and a law; its set points are constant."""
    loop = ControlLoop(law, 5e-3, Schedule(dict.fromkeys(law.setpoints, ((0.0, 0.1), (0.5, 0.2)))))
    return replace(base, problem=replace(base.problem, input=loop, duration=0.05))


def test_the_example_is_the_loop_in_python():
    loop = load_scenario(EXAMPLE).problem.input
    pid = PID("angle", "difference", 3 * BAR, 0.15, 0.02)
    difference = Cascade(pid, CoContraction(PRESSURES, 2.5 * BAR), (-2.4 * BAR,), (2.4 * BAR,))
    pressures = ProportionalFeedback(PRESSURES, ("left.command", "right.command"), 3.0 / BAR)
    law = Cascade(difference, pressures, (0.1 * BAR,) * 2, (5.5 * BAR,) * 2)
    sensors = (
        ColumnSensor("angle", 0.0879 * DEGREE, delay=2),
        *(ColumnSensor(n, 244.0, 500.0, delay=2) for n in PRESSURES),
    )
    assert loop.controller.sensors == sensors
    assert repr(loop.controller.law) == repr(law).replace("3e-05", repr(3 * (1 / BAR)))


def test_the_example_reaches_its_set_points_and_is_compiled():
    run = load_scenario(EXAMPLE).simulate()
    late = [np.interp(t, run["time"], run["angle"]) / DEGREE for t in (1.95, 3.45)]
    assert late == pytest.approx([15.0, -10.0], abs=0.2)
    assert any("compiled with the plant" in note for note in run.notes)
    assert np.ptp(run["angle"]) > 20 * DEGREE


def test_every_controller_that_a_file_may_name_is_written_and_read_back_equal(
    regulated: Scenario, laws, tmp_path: Path
):
    known = {n for n in model_names() if issubclass(model_class(n, "test"), Controller)}
    assert set(laws) == known
    for law in laws.values():
        scenario = with_law(regulated, law)
        again = load_scenario(save_scenario(scenario, tmp_path / "loop.toml"))
        assert again.problem.input.controller == law
        assert again.plant == scenario.plant
        assert again.initial_state == scenario.initial_state


def test_signals_drivers_and_runs_are_written_and_read_back():
    base = load_scenario(EXAMPLE.with_name("pressure_loop.toml"))
    loop = base.problem.input
    setpoint = Periodic(SampledSignal({"pressure": ((0.0, 1e5), (0.3, 2e5))}), 0.5)
    drivers = {**loop.drivers, "fill": SolenoidDriver(1e-3, 2e-3)}
    problem = replace(
        base.problem, input=replace(loop, setpoint=setpoint, drivers=drivers), output_times=0.01
    )
    scenario = replace(base, problem=problem, columns=("pressure",))
    tables = tomllib.loads(scenario_text(scenario))
    assert tables["input"]["controller"]["setpoint"] == {
        "model": "SampledSignal",
        "period": 0.5,
        "pressure": [[0.0, 1e5], [0.3, 2e5]],
    }
    assert tables["output"] == {"columns": ["pressure"]}
    assert [each["model"] for each in tables["input"]["drivers"]["discharge"]] == [
        "PWM",
        "SolenoidDriver",
    ]


def test_a_run_of_the_written_file_is_the_run(tmp_path: Path):
    scenario = load_scenario(EXAMPLE)
    short = replace(scenario, problem=replace(scenario.problem, duration=0.1))
    again = load_scenario(save_scenario(short, tmp_path / "short.toml"))
    assert np.array_equal(again.simulate()["angle"], short.simulate()["angle"])


def test_what_no_file_describes_is_not_written(regulated: Scenario, tmp_path: Path):
    class Own(PID):
        pass

    unregistered = with_law(regulated, Own("angle", "left.setpoint", 1.0))
    with pytest.raises(AirmuscleError, match="Own"):
        save_scenario(unregistered, tmp_path / "own.toml")
    uneven = replace(
        regulated, problem=Problem(regulated.plant, Schedule({}), 1.0, output_times=[0.1, 0.5])
    )
    with pytest.raises(
        ParameterError,
        match="output times that are not equidistant; write it as a program in Python",
    ):
        save_scenario(uneven, tmp_path / "own.toml")
    assert not list(tmp_path.iterdir())


def test_units_follow_from_the_signals_of_the_law_that_has_the_number(tmp_path: Path):
    scheduled = """
[input.controller.law.outer.outer]
model = "GainSchedule"
scheduled = "gain"
scheduling_column = "angular_speed"
breakpoints = ["0 deg/s", "90 deg/s"]
scheduled_values = ["3 bar/rad", "20 mbar/deg"]
[input.controller.law.outer.outer.law]"""
    law = load_scenario(
        written(tmp_path, ("\n[input.controller.law.outer.outer]", scheduled))
    ).problem.input.controller
    schedule = law.law.outer.outer
    assert schedule.breakpoints == pytest.approx((0.0, math.pi / 2))
    assert schedule.scheduled_values == pytest.approx((3e5, 0.02e5 / DEGREE))
    assert law.sensors[1].noise == pytest.approx(500.0)


def test_the_model_of_an_inverse_is_the_plant_unless_the_table_gives_another(tmp_path: Path):
    table = """
[input.controller.law.outer]
model = "AngleAndStiffness"
commanded = ["left.pressure", "right.pressure"]
gain = "20 N m/rad"
inverse = {{ model = "AntagonisticInverse", max_pressure = "5 bar", steps = 2{} }}
[input.controller.setpoint]
stiffness = [["0 s", "40 N m/rad"]]"""
    begin = TEXT.index("[input.controller.law.outer] ")
    end = TEXT.index("[input.controller.setpoint]")
    removed = TEXT[begin : end + len("[input.controller.setpoint]")]
    own = load_scenario(written(tmp_path, (removed, table.format(""))))
    assert own.problem.input.controller.law.outer.inverse.muscles == own.plant.muscles
    assert own.problem.input.controller.law.outer.inverse.mechanism == own.plant.mechanism
    named = (
        ', muscles = [{ library = "sarosi-dmsp-20-400n", name = "left", geometry = { model ='
        ' "Braid", radius = "10 mm", braid_angle = "24.4 deg", resting_length = "300 mm" } },'
        ' "dmsp-20-300"]'
    )
    other = load_scenario(
        written(tmp_path, (removed, table.format(named)))
    ).problem.input.controller.law.outer.inverse
    assert type(other.muscles[0].contractile.inner).__name__ == "Sarosi2012"
    assert other.muscles[1].contractile == own.plant.muscles[1].contractile


@pytest.mark.parametrize(
    ("was", "becomes", "kind", "message"),
    [
        (
            'model = "PID"',
            'model = "PDI"',
            UnknownNameError,
            r"\[input.controller.law.outer.outer\], model: no model 'PDI'",
        ),
        (
            'gain = "3 bar/rad"',
            'gain = "3 mm"',
            UnitError,
            (
                r"\[input.controller.law.outer.outer\], gain: unit 'mm' cannot be converted to"
                r" 'Pa/rad'"
            ),
        ),
        (
            'gain = "3 bar/rad"',
            'gian = "3 bar/rad"',
            ParameterError,
            (
                r"\[input.controller.law.outer.outer\]: PID has no parameter 'gian'.*Did you mean"
                r" 'gain'\?"
            ),
        ),
        (
            'gain = "3 bar/rad"\n',
            "",
            ParameterError,
            r"\[input.controller.law.outer.outer\]: PID needs 'gain'",
        ),
        (
            'gain = "3 bar/rad"',
            "gain = nan",
            ParameterError,
            r"\[input.controller.law.outer.outer\]: PID.gain .* is nan; it must be finite",
        ),
        (
            'minimum = ["-2.4 bar"]',
            "minimum = []",
            ParameterError,
            (
                r"\[input.controller.law.outer\]: Cascade: 0 minima and 1 maxima for 1 outer"
                r" commands \(difference\)"
            ),
        ),
        (
            'minimum = ["-2.4 bar"]',
            'minimum = ["-2.4 deg"]',
            UnitError,
            r"\[input.controller.law.outer\], minimum\[0\]: unit 'deg' cannot be converted to 'Pa'",
        ),
        (
            'minimum = ["-2.4 bar"]',
            'minimum = ["9 bar"]',
            ParameterError,
            r"'difference' has minimum 900000; it must be below its maximum 240000",
        ),
        (
            'minimum = ["-2.4 bar"]',
            'minimum = "-2.4 bar"',
            ParameterError,
            r"minimum is '-2.4 bar'; it must be a list of numbers",
        ),
        (
            'commanded = "difference"',
            'commanded = "diference"',
            ParameterError,
            (
                r"\[input.controller.law.outer.outer\], gain is '3 bar/rad'; the unit of the signal"
                r" 'diference' is not known"
            ),
        ),
        (
            'resolution = "2.44 mbar"',
            'resolution = "2 deg"',
            UnitError,
            (
                r"\[input.controller.sensors\[1\]\], resolution: unit 'deg' cannot be converted to"
                r" 'Pa'"
            ),
        ),
        (
            'resolution = "2.44 mbar"',
            'resolution = "-1 mbar"',
            ParameterError,
            r"\[input.controller.sensors\[1\]\]: ColumnSensor.resolution .* is -100",
        ),
        (
            "delay = 2",
            "delay = 2.5",
            ParameterError,
            r"\[input.controller.sensors\[0\]\]: delay is 2.5; it must be an integer",
        ),
        (
            "delay = 2",
            "delay = -1",
            ParameterError,
            r"ColumnSensor: delay is -1; allowed range: 0 to 1000",
        ),
        (
            'column = "angle"',
            'column = "angel"',
            ParameterError,
            (
                r"\[input.controller.sensors\[0\]\], resolution is '0.0879 deg'; the unit of the"
                r" signal 'angel' is not known"
            ),
        ),
        (
            "seed = 1",
            "seed = 1.5",
            ParameterError,
            r"WithSensors: seed is 1.5; it must be a whole number",
        ),
        (
            'model = "ColumnSensor"',
            'model = "PID"',
            ParameterError,
            (
                r"\[input.controller.sensors\[0\]\]: PID is not allowed here; a ColumnSensor is"
                r" required"
            ),
        ),
        (
            'measured = "angle"',
            'measured = "angel"',
            ParameterError,
            r"measures 'angel', which the plant does not have",
        ),
        (
            '"left.command", "right.command"',
            '"left.command"',
            ParameterError,
            (
                r"\[input.controller.law.inner\]: ProportionalFeedback: 2 columns and 1 commanded"
                r" inputs"
            ),
        ),
    ],
)
def test_an_error_names_table_and_key(
    tmp_path: Path, was: str, becomes: str, kind: type, message: str
):
    with pytest.raises(kind, match=message):
        load_scenario(written(tmp_path, (was, becomes)))


def test_a_number_without_a_unit_of_its_own_is_no_text(tmp_path: Path):
    twisting = (
        'model = "PID"',
        'model = "SuperTwisting"\nproportional = "1 bar"\nintegral = "2 bar/s"',
    )
    removed = ('gain = "3 bar/rad"\nintegral_time = "150 ms"\nderivative_time = "20 ms"\n', "")
    with pytest.raises(
        ParameterError, match=r"outer\], proportional is '1 bar'; it must be a number in SI units"
    ):
        load_scenario(written(tmp_path, twisting, removed))


def test_tune_writes_the_gains_of_inner_laws_in_the_units_of_the_file(tmp_path: Path):
    scenario = load_scenario_loop(EXAMPLE)
    assert set(scenario.bounds()) == {
        "law.inner.gain",
        "law.outer.outer.gain",
        "law.outer.outer.integral_time",
        "law.outer.outer.derivative_time",
    }
    path = scenario.save(
        {"law.outer.outer.gain": 2e5, "law.inner.gain": 5e-5}, tmp_path / "tuned.toml"
    )
    text = path.read_text(encoding="utf-8")
    assert 'gain = "2.000 bar/rad"' in text or re.search(r'gain = "2(\.0*)? bar/rad"', text)
    law = load_scenario(path).problem.input.controller.law
    assert (law.outer.outer.gain, law.inner.gain) == pytest.approx((2e5, 5e-5), rel=1e-14)
    assert law.outer.outer.integral_time == 0.15
    assert scenario.bounds(["law.outer.outer.gain=1 bar/rad:9 bar/rad"]) == {
        "law.outer.outer.gain": (1e5, 9e5)
    }


def test_compare_takes_the_controller_of_a_scenario(tmp_path: Path):
    joint = proportional_joint()
    contender = scenario_contender(joint, EXAMPLE)
    law = load_scenario(EXAMPLE).problem.input.controller.law.outer
    assert (contender.name, contender.law) == ("joint_cascade", law)
    assert set(contender.bounds) == {"outer.gain", "outer.integral_time", "outer.derivative_time"}
    foreign = EXAMPLE.with_name("pressure_loop.toml")
    with pytest.raises(
        ParameterError, match=r"\[input.controller\]: the law commands fill, discharge; allowed are"
    ):
        scenario_contender(joint, foreign)
