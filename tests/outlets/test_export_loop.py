"""Plant, controller and drivers as one program: in C, JavaScript and Octave the sampled loop makes
the rows and steps of the library, every column to 1e-9 of its greatest value."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import printed
import pytest
from called_controller import Called
from command_line import airmuscle
from control_plants import JOINT, LIFT, PRESSURE, PRESSURES, SPLIT

from airmuscle.control import PID, Cascade, OnOffController
from airmuscle.engine import (
    PWM,
    ColumnSensor,
    ControlLoop,
    Driver,
    Problem,
    RungeKutta4,
    SampledSignal,
    Schedule,
    SolenoidDriver,
    WithSensors,
    solve,
)
from airmuscle.errors import ParameterError
from airmuscle.files import load_scenario
from airmuscle.outlets import C99, JavaScript, Octave, write_program

STEP = Schedule({"pressure": ((0.0, 1e5), (0.1, 3e5))})
RAMP = SampledSignal({"pressure": ((0.0, 1e5), (0.087, 2.1e5), (0.2, 1.4e5))})
PULSES = (PWM(40.0, 1.1e-3), SolenoidDriver(1.3e-3, 1.7e-3, 2.1e-3, 0.0))
CHAINS = {"fill": PULSES, "discharge": PULSES}
START = LIFT.state_at(pressure=1e5)
OUTER = PID("position", "pressure", gain=4e6, integral_time=0.4, derivative_time=0.01)
SENSED = (
    ColumnSensor("position", resolution=5e-5, delay=2, lag=3e-3),
    ColumnSensor("pressure", noise=500.0, delay=1),
)
FILL = PID("pressure", "fill", gain=1e-5)
LEAK = SampledSignal({"discharge": ((0.0, 0.0), (0.033, 0.2), (0.04, 0.0), (0.3, 0.1))})
SCENARIO = Path(__file__).resolve().parents[2] / "examples" / "predictive_lift.toml"
PREDICTIVE = dataclasses.replace(load_scenario(SCENARIO).problem, duration=0.4)
"""A declaration of predictive control, whose limits act within the run."""
CASES = {
    "held commands, and an end between two samples": Problem(
        LIFT, ControlLoop(PRESSURE, 0.02, RAMP), 0.31, START
    ),
    "pulses through solenoids": Problem(
        LIFT, ControlLoop(PRESSURE, 0.03, STEP, drivers=CHAINS), 0.3, START
    ),
    "fixed steps, and an input that is not commanded": Problem(
        LIFT,
        ControlLoop(FILL, 0.02, STEP, LEAK, {"discharge": SolenoidDriver(1e-3)}),
        0.2,
        START,
        start_time=1.0,
        output_times=0.0031,
        integrator=RungeKutta4(1e-3),
    ),
    "two muscles": Problem(
        JOINT,
        ControlLoop(
            PRESSURES,
            0.01,
            SampledSignal(
                {
                    name: ((0.0, 1e5), (0.2, end))
                    for name, end in zip(PRESSURES.setpoints, (2e5, 1.4e5), strict=True)
                }
            ),
        ),
        0.2,
        JOINT.state_at(pressure=1e5),
    ),
    "a relay with solenoids": Problem(
        LIFT,
        ControlLoop(
            OnOffController("pressure", SPLIT, 1e4),
            0.005,
            STEP,
            drivers={"fill": SolenoidDriver(2e-3)},
        ),
        0.3,
        START,
    ),
    "predictive control": PREDICTIVE,
    "sensors with noise": Problem(
        LIFT,
        ControlLoop(
            WithSensors(Cascade(OUTER, PRESSURE, (0.0,), (5e5,)), SENSED, 7.0),
            0.005,
            Schedule({"position": ((0.0, 0.004), (0.1, 0.01))}),
        ),
        0.2,
        START,
    ),
}
SOME = [*list(CASES)[:3], "predictive control"]


def run_c(folder, *options):
    return printed.finished([printed.built(folder, *options, level="-O0")], folder)


def run_javascript(folder):
    return printed.finished([printed.require("node"), next(folder.glob("*.run.mjs")).name], folder)


def table(csv):
    """The columns of a CSV by name."""
    header, *rows = csv.splitlines()
    names = [heading.split(" [")[0] for heading in header.split(",")]
    return dict(zip(names, np.array([row.split(",") for row in rows], dtype=float).T, strict=True))


def check_loop(text, csv, problem):
    solution = solve(problem).raise_if_incomplete()
    found = table(csv)
    taken, rejected = map(int, re.search(r"(\d+) steps, (\d+) rejected", text).groups())
    assert (taken, rejected) == (solution.statistics.steps, solution.statistics.rejected_steps)
    assert set(found) == set(solution.recording)
    for name, values in found.items():
        expected = solution.recording[name]
        np.testing.assert_allclose(
            values, expected, rtol=0, atol=1e-9 * np.abs(expected).max(), err_msg=name
        )


RUN = {C99(): run_c, JavaScript(): run_javascript, Octave(): printed.run_octave}
IN_OCTAVE = SOME[2]
"""The case that Octave, which takes seconds, runs each time."""
PAIRS = [
    pytest.param(
        name,
        target,
        id=f"{name}-{type(target).__name__}",
        marks=(
            () if name in SOME and (target != Octave() or name == IN_OCTAVE) else pytest.mark.slow
        ),
    )
    for name in CASES
    for target in RUN
]


@pytest.mark.parametrize(("name", "target"), PAIRS)
def test_the_loop_is_that_of_the_library(name, target, tmp_path):
    problem = CASES[name]
    write_program(problem, tmp_path, target, name="loop")
    check_loop(*RUN[target](tmp_path), problem)


@pytest.mark.slow
def test_clang_builds_the_loop_as_gcc_does(tmp_path):
    problem = CASES["pulses through solenoids"]
    write_program(problem, tmp_path, C99(), name="loop")
    check_loop(*printed.finished([printed.built(tmp_path, compiler="clang")], tmp_path), problem)


def test_the_sources_of_a_loop_are_c_plus_plus_too(tmp_path):
    write_program(CASES["pulses through solenoids"], tmp_path, C99(), name="loop")
    options = ["-std=c++17", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
    command = [
        printed.require("g++"),
        *options,
        "-x",
        "c++",
        "main.c",
        "loop.c",
        "loop_controller.c",
    ]
    printed.finished(command, tmp_path)


@pytest.mark.slow
def test_the_program_has_no_undefined_behaviour(tmp_path):
    problem = CASES["pulses through solenoids"]
    write_program(problem, tmp_path, C99(), name="loop")
    check_loop(
        *run_c(tmp_path, "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
        problem,
    )


@pytest.mark.parametrize("target", [C99(), JavaScript()], ids=lambda target: type(target).__name__)
def test_constants_take_the_place_of_parameters_that_are_not_tunable(target, tmp_path):
    problem = CASES[SOME[0]]
    paths = write_program(
        problem, tmp_path, target, name="loop", tunable=["mechanism.mass", "controller.gain"]
    )
    check_loop(*RUN[target](tmp_path), problem)
    text = "".join(path.read_text() for path in paths)
    if target == C99():
        assert "#define LOOP_PARAMETERS 1\n" in text
        assert "#define LOOP_CONTROLLER_PARAMETERS 1\n" in text
    else:
        assert 'export const parameters = ["mechanism.mass"];' in text
        assert '"parameters": ["gain"]' in text


def test_a_gain_can_be_changed_in_the_program(tmp_path):
    problem = CASES[SOME[0]]
    changed = dataclasses.replace(
        problem.input, controller=dataclasses.replace(PRESSURE, gain=2 * PRESSURE.gain)
    )
    write_program(problem, tmp_path, JavaScript(), name="loop")
    index = "loop.parameters.indexOf('gain')"
    script = f"""import * as M from "./loop.mjs";
const {{loop}} = M, gains = [...loop.parameterDefaults];
gains[{index}] *= 2;
const {{columns, steps, rejected}} = M.simulate({{controllerParameters: gains}});
console.log(JSON.stringify(columns["pressure"]));
"""
    found = printed.run_node(script, {}, tmp_path)
    expected = solve(dataclasses.replace(problem, input=changed)).recording["pressure"]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.slow
def test_a_gain_can_be_changed_in_octave_where_the_others_are_constants(tmp_path):
    problem = CASES[SOME[0]]
    changed = dataclasses.replace(
        problem.input, controller=dataclasses.replace(PRESSURE, gain=2 * PRESSURE.gain)
    )
    write_program(
        problem, tmp_path, Octave(), name="loop", tunable=["mechanism.mass", "controller.gain"]
    )
    script = """model = loop(); disp(model.parameters{:}); disp(model.loop.parameters{:});
r = model.simulate(struct('controller_parameters', 2 * model.loop.parameter_defaults));
printf('%.17g\\n', r.data(:, strcmp(r.names, 'pressure')));"""
    command = [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval", script]
    mass, gain, *found = printed.finished(command, tmp_path)[1].splitlines()
    assert (mass, gain) == ("mechanism.mass", "gain")
    expected = solve(dataclasses.replace(problem, input=changed)).recording["pressure"]
    np.testing.assert_allclose(np.array(found, dtype=float), expected, rtol=1e-9)


def test_chosen_columns_are_written(tmp_path):
    write_program(
        CASES[SOME[0]], tmp_path, JavaScript(), name="loop", columns=["pressure", "command.fill"]
    )
    assert list(table(run_javascript(tmp_path)[1])) == ["time", "pressure", "command.fill"]


# What is refused


@dataclasses.dataclass(frozen=True)
class Slow(Driver):
    def init(self, start):
        return ()

    def step(self, state, command, start):
        return list(command), state


def of_loop(controller=PRESSURE, **changes):
    return Problem(LIFT, ControlLoop(controller, 0.02, STEP, **changes), 0.2, START)


@pytest.mark.parametrize(
    ("problem", "target", "options", "message"),
    [
        (
            of_loop(Called(PRESSURE)),
            C99(),
            {},
            "Called is a controller in Python and has no printed form. Derive a law of your own",
        ),
        (
            of_loop(drivers={"fill": Slow()}),
            C99(),
            {},
            "the driver Slow of 'fill' has no printed form; there are PWM, Sol",
        ),
        (
            of_loop(drivers={"fill": Slow()}),
            Octave(),
            {},
            "the driver Slow of 'fill' has no printed form",
        ),
        (of_loop(), C99(), {"tunable": ["gain"]}, r"Plant has no parameter 'gain'"),
        (
            of_loop(),
            C99(),
            {"tunable": ["controller.measured"]},
            "'measured' is fixed when a program is printed",
        ),
        (
            of_loop(),
            C99(),
            {"columns": ["command.fil"]},
            r"no column 'command\.fil'.*Did you mean 'command\.fill'",
        ),
        (of_loop(), C99(), {"name": "while"}, "cannot be the name of an exported program"),
    ],
)
def test_what_cannot_be_printed_is_refused_by_name(problem, target, options, message, tmp_path):
    with pytest.raises(ParameterError, match=message):
        write_program(problem, tmp_path / "out", target, **options)
    assert not (tmp_path / "out").exists()


def test_a_run_that_continues_another_is_refused(tmp_path):
    first = solve(of_loop())
    later = Problem(
        LIFT,
        of_loop().input,
        0.2,
        first.final_state,
        start_time=first.final_time,
        control_state=first.control_state,
    )
    with pytest.raises(ParameterError, match="a run that continues another cannot be exported"):
        write_program(later, tmp_path, C99())


def test_the_command_exports_the_loop_of_a_scenario(tmp_path):
    scenario = Path(__file__).parents[2] / "examples" / "pressure_loop.toml"
    done = airmuscle("export", scenario, "--to", "c", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    names = {
        "pressure_loop.h",
        "pressure_loop.c",
        "pressure_loop_controller.h",
        "pressure_loop_controller.c",
        "main.c",
        "CMakeLists.txt",
    }
    assert {path.name for path in tmp_path.iterdir()} == names
    assert "cc -O2 pressure_loop.c pressure_loop_controller.c main.c -lm -o run" in done.output
