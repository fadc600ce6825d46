"""A controller in a file is the loop that it describes: its numbers in any unit that fits where it
stands, its set point from rows or a data file. What does not fit is refused with file, table, key,
value, and what is allowed.

The code of docs/guides/control.md runs, its table is read, schema, report and studies know it.
"""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from scenario_files import writer_of

import airmuscle as am
from airmuscle.control import PID, OnOffController
from airmuscle.design import load_study
from airmuscle.engine import (
    PWM,
    ZERO_INPUT,
    ControlLoop,
    Periodic,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    SplitRange,
    WithDrivers,
)
from airmuscle.errors import (
    AirmuscleError,
    ColumnError,
    ParameterError,
    UnitError,
    UnknownNameError,
)
from airmuscle.files import load_scenario, run_chapter, scenario_schema
from airmuscle.files.scenario import describe_input

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "pressure_loop.toml"
PAGE = (ROOT / "docs" / "guides/control.md").read_text(encoding="utf-8")
PREDICTIVE, TABLE, NESTED = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)

VALVE = '{ model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }'
PLANT = f"""
[plant]
muscle = {{ library = "dmsp-20-300", damper = {{ model = "LinearDamper", damping = 300 }} }}
[plant.circuit]
model = "FillDischarge"
supply = {{ model = "Supply", pressure = "5 bar" }}
fill = {VALVE}
discharge = {VALVE}
[plant.mechanism]
model = "HangingMass"
mass = "5 kg"
[run]
duration = "300 ms"
initial_state = {{ pressure = "1 bar" }}
"""
SETPOINT = 'pressure = [["0 s", "1 bar"], ["100 ms", "2 bar"]]'
GOOD = f"""{PLANT}
[input]
[input.controller]
model = "PID"
measured = "pressure"
commanded = "fill"
gain = "1.5 1/bar"
integral_time = "300 ms"
sample_time = "5 ms"
[input.controller.setpoint]
{SETPOINT}
"""
written = writer_of(GOOD)


# What is right


def test_the_code_of_the_page_runs():
    found: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
        exec(compile(block, "guides/control.md", "exec"), found)
    for run in (found["run"], found["other"]):
        assert run["pressure"][-1] == pytest.approx(3e5, rel=0.05)


def test_the_table_of_the_page_is_a_loop(tmp_path: Path):
    held = PLANT.replace(
        'model = "HangingMass"\nmass = "5 kg"',
        'model = "WithLatch"\ninner = { model = "HangingMass", mass = 5 }',
    )
    scenario = load_scenario(written(tmp_path, text=f"{held}{TABLE}"))
    pid = PID("position", SplitRange("fill", "discharge"), 40.0, 1.0, 0.05)
    wanted = Schedule({"position": ((0.0, 0.0), (0.2, 0.02))})
    beside = Schedule({"latched": ((0.0, 1.0), (0.1, 0.0))})
    assert scenario.problem.input == ControlLoop(
        pid, 5e-3, wanted, beside, {"fill": PWM(200.0), "discharge": PWM(200.0)}
    )
    run = scenario.simulate()
    assert np.ptp(run["position"][run["time"] <= 0.1]) < 1e-12
    assert run["position"][-1] > run["position"][0] + 1e-3


def test_the_table_of_predictive_control_is_that_of_the_example():
    example = tomllib.loads((EXAMPLE.parent / "predictive_lift.toml").read_text(encoding="utf-8"))
    page = tomllib.loads(PREDICTIVE)["input"]["controller"]
    assert page == {
        key: value for key, value in example["input"]["controller"].items() if key != "setpoint"
    }


def test_the_table_of_laws_inside_laws_is_that_of_the_example():
    example = (EXAMPLE.parent / "joint_cascade.toml").read_text(encoding="utf-8")
    page, whole = (tomllib.loads(text)["input"]["controller"] for text in (NESTED, example))
    assert page["law"]["inner"] == whole["law"]["inner"]
    assert page["sensors"] == whole["sensors"][:1]
    for key in ("minimum", "maximum", "model"):
        assert page["law"][key] == whole["law"][key]
    assert {key: page[key] for key in ("model", "seed", "sample_time")} == {
        key: whole[key] for key in ("model", "seed", "sample_time")
    }


@pytest.mark.parametrize(
    ("gain", "value"),
    [('"1.5 1/bar"', 1.5e-5), ('"15 1/MPa"', 1.5e-5), ('"0.2 %/kPa"', 2e-6), ("1.5e-5", 1.5e-5)],
)
def test_a_gain_has_any_unit_that_fits(tmp_path: Path, gain: str, value: float):
    scenario = load_scenario(written(tmp_path, ('"1.5 1/bar"', gain)))
    assert scenario.problem.input.controller.gain == pytest.approx(value, rel=1e-12)


def regulated(commanded: str = '"setpoint"', gain: str = '"0.5 bar/bar"') -> str:
    regulator = (
        'model = "ProportionalRegulator"\nlag = { model = "SecondOrderLag", frequency = 20 }'
    )
    text = GOOD.replace('model = "FillDischarge"', regulator).replace('"fill"', commanded)
    return text.replace('"1.5 1/bar"', gain)


def test_units_follow_from_column_and_input(tmp_path: Path):
    text = regulated().replace(
        "[input.controller.setpoint]", 'initial_output = "1.2 bar"\n[input.controller.setpoint]'
    )
    controller = load_scenario(written(tmp_path, text=text)).problem.input.controller
    assert (controller.gain, controller.initial_output) == (0.5, 1.2e5)
    height = (
        ('measured = "pressure"', 'measured = "position"'),
        (
            SETPOINT,
            'position = [[0, "10 mm"]]',
        ),
    )
    controller = load_scenario(
        written(tmp_path, *height, text=regulated(gain='"20 kPa/mm"'))
    ).problem.input.controller
    assert controller.gain == pytest.approx(2e7)
    two = load_scenario(
        written(
            tmp_path,
            ('model = "PID"', 'model = "OnOffController"'),
            ('gain = "1.5 1/bar"\nintegral_time = "300 ms"', 'hysteresis = "20 kPa"'),
        )
    )
    assert two.problem.input.controller == OnOffController("pressure", "fill", 2e4)


def test_a_set_point_is_a_command_of_any_kind(tmp_path: Path):
    (tmp_path / "wanted.csv").write_text(
        "time [ms],pressure [kPa],other [bar]\n0,100,1\n200,300,2\n", encoding="utf-8"
    )
    corners = ((0.0, 1e5), (0.2, 3e5))
    for rows, expected in (
        (
            'model = "SampledSignal"\npressure = [[0, "1 bar"], ["0.2 s", 3e5]]',
            SampledSignal({"pressure": corners}),
        ),
        ('file = "wanted.csv"', SampledSignal({"pressure": corners})),
        (
            'file = "wanted.csv"\nmodel = "Schedule"\nperiod = "0.3 s"',
            Periodic(Schedule({"pressure": corners}), 0.3),
        ),
        (
            'file = "wanted.csv"\ncolumns = { pressure = "other" }',
            SampledSignal({"pressure": ((0.0, 1e5), (0.2, 2e5))}),
        ),
    ):
        assert load_scenario(written(tmp_path, (SETPOINT, rows))).problem.input.setpoint == expected


def test_drivers_and_inputs_beside_stand_where_they_always_do(tmp_path: Path):
    beside = (
        'discharge = [["0.1 s", 0.5]]\ndrivers = { fill = [{ model = "PWM", frequency = 100 },'
        ' "SolenoidDriver"] }\n'
    )
    command = load_scenario(written(tmp_path, ("[input]\n", f"[input]\n{beside}"))).problem.input
    assert command.other_inputs == Schedule({"discharge": ((0.1, 0.5),)})
    assert command.drivers == {"fill": (PWM(100.0), SolenoidDriver())}
    assert load_scenario(written(tmp_path)).problem.input.other_inputs == ZERO_INPUT


def test_the_columns_of_a_loop_may_be_asked_for(tmp_path: Path):
    asked = ("[run]", '[output]\ncolumns = ["setpoint.pressure", "command.fill"]\n[run]')
    scenario = load_scenario(written(tmp_path, asked))
    assert list(scenario.select_columns(scenario.simulate())) == [
        "time",
        "setpoint.pressure",
        "command.fill",
    ]


# What is wrong

PID_TABLE = (
    'commanded = "fill"',
    'commanded = {{ model = "SplitRange", positive = "{}", negative = "{}" }}',
)


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
@pytest.mark.parametrize(
    ("was", "becomes", "kind", "message"),
    [
        (
            'measured = "pressure"',
            'measured = "presure"',
            ParameterError,
            (
                r"toml, \[input.controller\]: PID measures 'presure', which .*Did you mean"
                r" 'pressure'\?"
            ),
        ),
        (
            'measured = "pressure"',
            'measured = "fill"',
            ParameterError,
            r"PID measures 'fill', which the plant does not have; there are",
        ),
        (
            'measured = "pressure"',
            "measured = 3",
            ParameterError,
            r"\[input.controller\]: measured is 3; it must be a text",
        ),
        (
            'measured = "pressure"\n',
            "",
            ParameterError,
            r"\[input.controller\]: PID needs 'measured' \(a text in quotes\); it is missing",
        ),
        (
            'commanded = "fill"',
            'commanded = "fil"',
            ParameterError,
            (
                r"\[input.controller\]: the plant has no input 'fil'; there are fill, discharge."
                r" Did you mean 'fill'\?"
            ),
        ),
        (
            'commanded = "fill"',
            "commanded = 3",
            ParameterError,
            r"commanded is 3; it must be a text in quotes or a SplitRange",
        ),
        (
            'commanded = "fill"',
            PID_TABLE[1].format("fill", "vent"),
            ParameterError,
            r"\[input.controller\]: the plant has no input 'vent'",
        ),
        (
            'commanded = "fill"',
            PID_TABLE[1].format("fill", "fill"),
            ParameterError,
            r"SplitRange: both inputs are 'fill'",
        ),
        (
            '"1.5 1/bar"',
            '"1.5 1/mm"',
            UnitError,
            r"\[input.controller\], gain: unit '1/mm' cannot be converted to '1/Pa'",
        ),
        ('"1.5 1/bar"', '"1.5"', UnitError, r"gain: '1.5' has no unit; write it like '1.5 1/Pa'"),
        (
            '"1.5 1/bar"',
            "nan",
            ParameterError,
            r"\[input.controller\]: PID.gain .* is nan; it must be finite",
        ),
        ('"1.5 1/bar"', "inf", ParameterError, r"PID.gain .* is inf; it must be finite"),
        ('"1.5 1/bar"', "true", ParameterError, r"gain is True; it must be a number in 1/Pa"),
        (
            "integral_time",
            "integral_tim",
            ParameterError,
            r"PID has no parameter 'integral_tim'; .*mean 'integral_time'\?",
        ),
        (
            '"300 ms"\nsample_time',
            '"-3 ms"\nsample_time',
            ParameterError,
            r"PID.integral_time .* is -0.003 s; allowed range: 0 to",
        ),
        (
            'sample_time = "5 ms"',
            'sample_time = "0 ms"',
            ParameterError,
            r"\[input.controller\], sample_time is '0 ms'; it must be greater than zero",
        ),
        (
            'sample_time = "5 ms"',
            "sample_time = -1",
            ParameterError,
            r"sample_time is -1; it must be greater than zero",
        ),
        (
            'sample_time = "5 ms"',
            "sample_time = nan",
            ParameterError,
            r"\[input.controller\], sample_time is nan; it must be finite",
        ),
        (
            'sample_time = "5 ms"',
            'sample_time = "5 bar"',
            UnitError,
            r"sample_time: unit 'bar' cannot be converted to 's'",
        ),
        (
            'sample_time = "5 ms"',
            'sample_time = "1 s"',
            ParameterError,
            r"\[input\]: the sample time of the controller is 1 s, longer than the run of 0.3 s",
        ),
        (
            'sample_time = "5 ms"\n',
            "",
            ParameterError,
            (
                r"\[input.controller\]: 'sample_time' is missing: sample time, such as sample_time"
                r" = \"10 ms\""
            ),
        ),
        (
            "[input.controller.setpoint]",
            "[plant.setpoint]",
            ParameterError,
            r"unknown key 'setpoint'; there are muscle",
        ),
        (
            f"[input.controller.setpoint]\n{SETPOINT}",
            "",
            ParameterError,
            r"'setpoint' is missing: set point, the table \[input.controller.setpoint\]",
        ),
        (
            SETPOINT,
            "",
            ParameterError,
            r"ControlLoop.setpoint names nothing; the set points of PID are pressure",
        ),
        (
            SETPOINT,
            "presure = [[0, 1]]",
            ParameterError,
            (
                r"\[input.controller.setpoint\]: the controller has no set point 'presure'; there"
                r" are pressure.*Did you mean"
            ),
        ),
        (
            SETPOINT,
            'pressure = [[0, "1 mm"]]',
            UnitError,
            r"setpoint\], pressure: unit 'mm' cannot be converted to 'Pa'",
        ),
        (
            SETPOINT,
            "pressure = [[0, nan]]",
            ParameterError,
            r"setpoint\], pressure is nan; it must be finite",
        ),
        (
            SETPOINT,
            "pressure = 3",
            ParameterError,
            r"setpoint\], pressure is 3; it must be a list of instants and values",
        ),
        (
            SETPOINT,
            f'{SETPOINT}\ndrivers = {{ pressure = "SolenoidDriver" }}',
            ParameterError,
            r"a set point has no drivers; write \[input.drivers\]",
        ),
        (
            SETPOINT,
            f"{SETPOINT}\ncontroller = 3",
            ParameterError,
            r"only a scenario has a controller",
        ),
        (SETPOINT, 'file = "none.csv"', AirmuscleError, r"none.csv"),
        (
            'model = "PID"',
            'model = "Valve"',
            ParameterError,
            (
                r"\[input.controller\]: Valve is not allowed here; a Controller is required:"
                r" AngleAndStiffness, Cascade, .*OnOffController, PID"
            ),
        ),
        (
            'model = "PID"',
            'model = "PDI"',
            UnknownNameError,
            (
                r"no model 'PDI'; there are AngleAndStiffness, .*, PID, .*WithStuckValve\. Did you"
                r" mean 'PID'"
            ),
        ),
        ('model = "PID"\n', "", ParameterError, r"\[input.controller\]: the model is not named"),
        (
            "[input]\n",
            '[input]\nfill = [["0.1 s", 1]]\n',
            ParameterError,
            r"'fill' is commanded by the controller and by other_inputs",
        ),
        (
            "[input]\n",
            '[input]\ndischarge = [["0.1 s", 2]]\n',
            ParameterError,
            r"\[input\]: the input 'discharge' is 2 before",
        ),
        (
            "[input]\n",
            '[input]\ndrivers = { vent = "SolenoidDriver" }\n',
            ParameterError,
            r"\[input.drivers\]: the plant has no input 'vent'",
        ),
    ],
)
def test_a_loop_that_cannot_be_is_refused(
    tmp_path: Path, was: str, becomes: str, kind: type, message: str
):
    with pytest.raises(kind, match=message):
        load_scenario(written(tmp_path, (was, becomes)))


def test_what_is_no_table_of_a_controller_is_refused(tmp_path: Path):
    i = GOOD.index("[input.controller]")
    for given in ("3", '"PID"'):
        with pytest.raises(
            ParameterError,
            match=(
                r'\[input.controller\] is .*; it must be a table. Write model = "PID", its'
                r" parameters"
            ),
        ):
            load_scenario(written(tmp_path, text=f"{GOOD[:i]}controller = {given}"))
    flat = (
        f'{GOOD[:i]}controller = {{ model = "PID", measured = "pressure", commanded = "fill", gain'
        " = 1, sample_time = 1e-3, setpoint = 3 }"
    )
    with pytest.raises(
        ParameterError,
        match=(
            r"\[input.controller\], setpoint is 3; it must be a table of set points, such as"
            r' pressure = \[\["0 s"'
        ),
    ):
        load_scenario(written(tmp_path, text=flat))


def test_two_inputs_of_one_command_are_of_one_kind(tmp_path: Path):
    text = regulated('{ model = "SplitRange", positive = "setpoint", negative = "latched" }')
    text = text.replace(
        'model = "HangingMass"\nmass = "5 kg"',
        'model = "WithLatch"\ninner = { model = "HangingMass", mass = 5 }',
    )
    with pytest.raises(
        ParameterError,
        match="setpoint and latched have different units; choose inputs of the same unit",
    ):
        load_scenario(written(tmp_path, text=text))


def test_a_column_that_a_set_point_follows_is_there(tmp_path: Path):
    (tmp_path / "wanted.csv").write_text("time [s],valve\n0,1\n1,2\n", encoding="utf-8")
    with pytest.raises(
        ColumnError, match=r"wanted.csv has no column with the name of an input \(pressure\)"
    ):
        load_scenario(written(tmp_path, (SETPOINT, 'file = "wanted.csv"')))


def test_a_record_has_no_controller(tmp_path: Path):
    from airmuscle.files.library import Location
    from airmuscle.files.scenario.values import build_input_signal

    with pytest.raises(
        ParameterError,
        match=r"record, \[input\]: only a scenario has a controller; give commanded inputs",
    ):
        build_input_signal({"controller": {}}, (), Location("record", "input", tmp_path))


# Schema, report, program, study


def judged(tables: dict[str, object]) -> list[str]:
    """What a scenario has against the schema."""
    jsonschema = pytest.importorskip("jsonschema")
    return [
        e.message for e in jsonschema.Draft202012Validator(scenario_schema()).iter_errors(tables)
    ]


@pytest.mark.parametrize(
    "text", [GOOD, regulated(), f"{PLANT}{TABLE}", EXAMPLE.read_text(encoding="utf-8")]
)
def test_the_schema_takes_what_the_program_takes(text: str):
    assert judged(tomllib.loads(text)) == []


@pytest.mark.parametrize(
    ("was", "becomes"),
    [
        ('model = "PID"', 'model = "PDI"'),
        ('sample_time = "5 ms"\n', ""),
        ('sample_time = "5 ms"', "sample_time = -1"),
        ('measured = "pressure"\n', ""),
        ("integral_time", "integral_tim"),
        ('"300 ms"\nsample_time', '"300 ms"\nsetpoint_weight = 3\nsample_time'),
        ('"1.5 1/bar"', '"1,5 1/bar"'),
        ('"1.5 1/bar"', "true"),
        (SETPOINT, "pressure = 3"),
        (SETPOINT, f'{SETPOINT}\ndrivers = {{ pressure = "SolenoidDriver" }}'),
        (f"[input.controller.setpoint]\n{SETPOINT}", ""),
    ],
)
def test_what_the_schema_refuses_the_program_refuses(tmp_path: Path, was: str, becomes: str):
    path = written(tmp_path, (was, becomes))
    assert judged(tomllib.loads(path.read_text(encoding="utf-8")))
    with pytest.raises(AirmuscleError):
        load_scenario(path)


def test_the_schema_knows_every_controller():
    tables = scenario_schema()["properties"]["input"]["properties"]["controller"]["anyOf"]
    named = {table["properties"]["model"]["const"]: table for table in tables}
    assert list(named) == [
        "AngleAndStiffness",
        "Cascade",
        "CoContraction",
        "ComputedTorque",
        "DeadZoneController",
        "Decentralised",
        "FrictionFeedForward",
        "GainSchedule",
        "HysteresisCompensation",
        "MotionFeedForward",
        "Multirate",
        "OnOffController",
        "PID",
        "PredictiveControl",
        "ProportionalFeedback",
        "RepetitiveControl",
        "SetpointCommand",
        "SetpointLead",
        "SigmaDelta",
        "SlidingMode",
        "SmithPredictor",
        "StateFeedback",
        "StaticFeedForward",
        "SuperTwisting",
        "WithCommandDelay",
        "WithFeedForward",
        "WithFilter",
        "WithManual",
        "WithRateLimit",
        "WithSensors",
        "WithSetpointDelay",
        "WithStuckValve",
    ]
    assert named["PID"]["properties"]["gain"]["description"] == "K [u/y]: proportional gain"


def test_the_report_shows_set_point_and_measurement_with_units():
    scenario = load_scenario(EXAMPLE)
    run = scenario.simulate()
    chapter = run_chapter(scenario, run)
    loop, whole, inputs = chapter.plots
    lines = {line.get_label(): line.get_xydata() for line in loop.draw().axes[0].lines}
    assert lines["set point"].tolist() == [
        [0, 100],
        [1, 100],
        [1, 300],
        [3, 300],
        [3, 150],
        [5, 150],
    ]
    assert np.array_equal(lines["measured"][:, 1], run["pressure"] * 1e-3)
    assert loop.draw().axes[0].get_ylabel() == "pressure\n[kPa]"
    assert all("setpoint" not in axis.get_ylabel() for axis in whole.draw().axes)
    applied = {line.get_label(): line.get_xydata() for line in inputs.draw().axes[0].lines}
    assert set(applied) == {"command", "applied input"}
    assert inputs.caption.endswith("; dashed: commands to the drivers.")
    table = chapter.tables[2]
    assert table.title == "Parameters of the controller, PID"
    assert (
        dict(zip(table.columns["parameter"], table.columns["unit"], strict=True))["gain"] == "1/Pa"
    )
    assert "astrom-hagglund-1995" in [r.key for r in chapter.references]
    settings = {name: value for name, value, _ in chapter.chosen}
    assert settings["inputs"].startswith(
        "PID, sample time 0.02 s, manipulated inputs fill, discharge; set point: pressure 100000"
        " from 0 s,"
    )


def test_a_loop_without_drivers_is_drawn_to_its_end(tmp_path: Path):
    scenario = load_scenario(written(tmp_path, ('sample_time = "5 ms"', 'sample_time = "0.5 ms"')))
    run = scenario.simulate()
    plot = run_chapter(scenario, run).plots[-1]
    (applied,) = [line.get_xydata() for line in plot.draw().axes[0].lines]
    assert plot.caption == "Inputs applied to the plant."
    assert applied[-1, 0] == 0.3
    assert describe_input(scenario.problem.input).endswith("; other inputs: none")
    assert not isinstance(scenario.problem.input.as_open_loop(run), WithDrivers)


def test_a_run_that_ends_early_is_reported(tmp_path: Path):
    """RungeKutta4 with steps far too long for the valves."""
    changes = (
        (
            "3e-9, critical_ratio = 0.3 }\ndischarge",
            "9e-6, critical_ratio = 0.3 }\ndischarge",
        ),
        (
            'duration = "300 ms"',
            'duration = "300 ms"\nintegrator = { model = "RungeKutta4", step = "5 ms" }',
        ),
    )
    done = airmuscle("simulate", written(tmp_path, *changes), "--out", tmp_path / "run")
    assert done.exit_code == 1
    assert "ended early" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "run" / "figures" / "loop.png").exists()


def test_the_program_runs_the_example(tmp_path: Path):
    done = airmuscle("simulate", EXAMPLE, "--out", tmp_path / "run", "--json")
    assert done.exit_code == 0, done.output
    shown = json.loads(done.stdout)
    ranges = {row["column"]: row for row in shown["simulation"]["ranges"]}
    assert ranges["setpoint.pressure"]["unit"] == "kPa"
    assert ranges["pressure"]["last"] == pytest.approx(150.0, rel=0.05)
    with (tmp_path / "run" / "recording.csv").open(encoding="utf-8") as file:
        heading = next(row for row in csv.reader(file) if row[0] == "time [s]")
    assert {"measured.pressure [Pa]", "command.discharge [1]"} <= set(heading)


def test_a_controller_of_many_parts_is_named_by_them_and_a_single_one_with_its_gains():
    cascade, single = (
        load_scenario(ROOT / "examples" / name).problem.input
        for name in ("joint_cascade.toml", EXAMPLE)
    )
    parts = "WithSensors(Cascade(Cascade(PID, CoContraction), ProportionalFeedback), ColumnSensor, "
    assert cascade.describe({}).startswith(parts)
    assert single.describe({}).startswith(
        "PID(measured='pressure', commanded=SplitRange(positive='fill', "
    )
    assert f"gain={single.controller.gain:.12g}, " in single.describe({})


@pytest.mark.slow  # `./run test` runs all examples
def test_the_program_of_the_example_runs(tmp_path: Path):
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "lift_controllers.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "stopped after 2 s and resumed, the run has the same final state: True" in done.stdout
    assert (tmp_path / "report" / "examples" / "control.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_example_of_control_laws_tracks_learns_and_reaches_angle_and_stiffness(tmp_path):
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "joint_control_laws.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    errors = {
        name: float(value)
        for name, value in re.findall(r"^(.*): rms error ([\d.]+) mm$", done.stdout, re.MULTILINE)
    }
    assert errors["feed-forward and feedback"] < 0.5 * min(
        errors["feedback"], errors["feed-forward"]
    )
    first, last = map(
        float, re.search(r"learning: rms error ([\d.]+) mm .*, ([\d.]+) mm", done.stdout).groups()
    )
    assert last < 0.05 * first
    angle = re.search(
        r"angle ([\d.]+) rad for 0.3, stiffness ([\d.]+) N m/rad for ([\d.]+)", done.stdout
    ).groups()
    assert float(angle[0]) == pytest.approx(0.3, rel=0.05)
    assert float(angle[1]) == pytest.approx(float(angle[2]), rel=0.05)
    assert (tmp_path / "control_laws.png").stat().st_size > 10_000


STUDY = """
title = "gains"
scenario = "scenario.toml"
[vary]
"input.controller.gain" = ["0.5 1/bar", "2 1/bar"]
"input.controller.setpoint.pressure[1][1]" = ["1.5 bar", "2 bar"]
[design]
model = "Grid"
[metrics]
last = { model = "Final", column = "setpoint.pressure" }
told = { model = "Maximum", column = "command.fill" }
"""


def test_a_study_varies_the_numbers_of_a_controller(tmp_path: Path):
    written(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    found = [study.scenario(i) for i in range(4)]
    assert [s.problem.input.controller.gain for s in found] == pytest.approx(
        [5e-6, 5e-6, 2e-5, 2e-5]
    )
    assert [s.problem.input.setpoint.changes["pressure"][1][1] for s in found] == [
        1.5e5,
        2e5,
        1.5e5,
        2e5,
    ]
    done = airmuscle("study", tmp_path / "study.toml", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    (tmp_path / "study.toml").write_text(
        STUDY.replace("controller.gain", "controller.gian"), encoding="utf-8"
    )
    with pytest.raises(
        AirmuscleError, match=r"input.controller.gian.*Did you mean 'input.controller.gain'"
    ):
        load_study(tmp_path / "study.toml")


def test_a_fingerprint_leaves_out_rooms_that_exist_and_no_controllers():
    """A study depends on the program of its controllers."""
    from airmuscle.core.tree import EXCLUDED_ROOMS

    rooms = {path.parent.name for path in Path(am.__file__).parent.glob("*/__init__.py")}
    assert set(EXCLUDED_ROOMS) <= rooms
    assert not {"core", "engine", "physics", "control", "files", "design"} & set(EXCLUDED_ROOMS)
