"""A control law on a microcontroller: the C function of its memory gives, bit by bit, the commands
of the operations that were printed, and those of the library to 1e-12 of their range."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import printed
import pytest
from called_controller import Called
from command_line import airmuscle
from control_plants import LIFT, PRESSURE, SPLIT
from widths import widened

from airmuscle.control import (
    PID,
    Cascade,
    DeadZoneController,
    GainSchedule,
    OnOffController,
    SlidingMode,
    SuperTwisting,
    WithStuckValve,
    design_predictive,
)
from airmuscle.engine import (
    PWM,
    ColumnSensor,
    ControlLoop,
    Double,
    Problem,
    Schedule,
    SigmaDelta,
    Single,
    WithSensors,
    solve,
)
from airmuscle.engine.run import prepare_loop
from airmuscle.errors import FileError, ParameterError
from airmuscle.outlets import write_controller
from airmuscle.outlets.export import printed_predictive
from airmuscle.outlets.export.compiler import COMPILER, EMULATOR, PROCESSORS, build_and_run
from airmuscle.outlets.export.printed_controller import print_controller
from airmuscle.physics import linearise

SENSED = (
    ColumnSensor("position", resolution=5e-5, delay=2, lag=3e-3),
    ColumnSensor("pressure", noise=500.0, delay=1),
)
OUTER = PID("position", "pressure", gain=4e6, integral_time=0.4, derivative_time=0.01)
CASCADE = Cascade(OUTER, PRESSURE, (0.0,), (5e5,))
POSITION = Schedule({"position": ((0.0, 0.004), (0.2, 0.01))})
STEP = Schedule({"pressure": ((0.0, 1e5), (0.2, 3e5))})


def problem_of(law, setpoint=STEP, duration=0.5):
    return Problem(LIFT, ControlLoop(law, 0.005, setpoint), duration, LIFT.state_at(pressure=1e5))


def replay(folder, *options):
    """What the replay says."""
    return subprocess.run([printed.built(folder, *options)], capture_output=True, text=True)


CASES = {
    "PI": (PRESSURE, STEP),
    "on-off": (OnOffController("pressure", SPLIT, 1e4), STEP),
    "cascade": (CASCADE, POSITION),
    "sliding mode": (SlidingMode("position", SPLIT, 1.0, 0.05, 1e-3, 5e-3), POSITION),
    "super-twisting": (SuperTwisting("position", SPLIT, 10.0, 1.0, 0.05, 5e-3), POSITION),
    "dead zone": (
        DeadZoneController("position", SPLIT, 3e-4, lead_time=0.04, filter_time=5e-3),
        POSITION,
    ),
    "gain schedule": (
        Cascade(
            GainSchedule(OUTER, "gain", "pressure", (0.0, 3e5), (6e6, 2e6)),
            PRESSURE,
            (0.0,),
            (5e5,),
        ),
        POSITION,
    ),
    "sigma-delta": (SigmaDelta(CASCADE, 0.05), POSITION),
    "sensors with noise": (WithSensors(CASCADE, SENSED, 7.0), POSITION),
}


NAMES = [
    pytest.param(name, marks=() if name in ("PI", "cascade") else pytest.mark.slow)
    for name in CASES
]


@pytest.mark.parametrize("name", NAMES)
def test_the_replay_agrees_bit_by_bit(name, tmp_path):
    law, setpoint = CASES[name]
    write_controller(problem_of(law, setpoint), tmp_path, name="law")
    for options in (("-O0",), ("-O2",)):
        done = replay(tmp_path, *options)
        assert done.returncode == 0, done.stdout + done.stderr
        assert re.match(
            r"100 samples, 0 commands differ; memory \d+ bytes, parameters \d+ bytes", done.stdout
        )


@pytest.mark.parametrize("name", NAMES)
def test_the_replayed_commands_are_those_of_the_recorded_run(name):
    """The library computes with fused and reordered operations: equal to 1e-9 of the range of the
    command.
    """
    law, setpoint = CASES[name]
    problem = problem_of(law, setpoint)
    prepared = prepare_loop(problem, problem.input.init(0.0))
    recording = solve(problem).recording
    rows = np.searchsorted(recording["time"], prepared.instants[:-1] - 1e-9)
    columns = [recording[f"measured.{n}"][rows] for n in law.measured_columns]
    commands = print_controller(prepared, "law").replay(
        np.column_stack(columns), prepared.setpoint_values
    )
    recorded = np.column_stack([recording[f"command.{n}"][rows] for n in law.inputs])
    assert np.ptp(recorded) > 0
    np.testing.assert_allclose(commands, recorded, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_in_single_precision_the_commands_stay_within_the_stated_tolerance(name, tmp_path):
    """Also the one with sensors, whose random numbers are whole numbers beyond single precision:
    they are left out.
    """
    law, setpoint = CASES[name]
    write_controller(problem_of(law, setpoint), tmp_path, name="law", precision=Single())
    assert "double" not in (tmp_path / "law.c").read_text().split("*/", 1)[1]
    done = replay(tmp_path, "-O0")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.match(
        r"100 samples, 0 commands differ by more than 0\.0001 of their range", done.stdout
    )


@pytest.mark.parametrize(
    ("precision", "processor"),
    widened(
        [(precision, processor) for precision in (Double(), Single()) for processor in PROCESSORS],
        lambda precision, processor: (
            isinstance(precision, Double) == (processor == next(iter(PROCESSORS)))
        ),
    ),
    ids=str,
)
def test_on_a_cortex_m_the_commands_are_the_same(precision, processor, tmp_path):
    """In double precision bit by bit as on this machine."""
    for program in (COMPILER, EMULATOR):
        printed.require(program)
    law, setpoint = CASES["cascade"]
    paths = write_controller(problem_of(law, setpoint), tmp_path, name="law", precision=precision)
    built = build_and_run(paths, PROCESSORS[processor])
    assert built.output.startswith("100 samples, 0 commands differ")
    assert 100 < built.code_size < 8000
    assert 0 < built.stack_size < 2000


def test_a_replay_that_differs_fails_on_a_cortex_m(tmp_path):
    for program in (COMPILER, EMULATOR):
        printed.require(program)
    paths = write_controller(problem_of(PRESSURE), tmp_path, name="law", tunable=["gain"])
    source = tmp_path / "law.c"
    source.write_text(
        source.read_text().replace(
            "double law_parameters[LAW_PARAMETERS + 1] = {",
            "double law_parameters[LAW_PARAMETERS + 1] = {0.0 * ",
        )
    )
    with pytest.raises(
        FileError,
        match=r"qemu-system-arm failed with exit code 1: 100 samples, \d+ commands differ",
    ):
        build_and_run(paths, PROCESSORS["cortex-m4"])


def test_without_a_compiler_for_the_processor_the_packages_are_named(tmp_path, monkeypatch):
    paths = write_controller(problem_of(PRESSURE), tmp_path, name="law")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(
        ParameterError,
        match=r"arm-none-eabi-gcc was not found\..*install the packages gcc-arm-none-eabi",
    ):
        build_and_run(paths, PROCESSORS["cortex-m4"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--controller", "--precision", "half"),
            "--precision is 'half'; allowed range: double, float",
        ),
        (("--precision", "float"), "--precision belongs to --controller"),
        (
            ("--controller", "--build", "--processor", "avr"),
            "--processor is 'avr'; allowed range: cortex-m4, cortex-m7",
        ),
        (
            ("--controller", "--processor", "cortex-m4"),
            "--processor belongs to --controller --build",
        ),
    ],
)
def test_options_of_a_controller_that_do_not_fit_are_refused(options, message, tmp_path):
    scenario = Path(__file__).parents[2] / "examples" / "pressure_loop.toml"
    done = airmuscle("export", scenario, "--to", "c", "--out", tmp_path / "out", *options)
    assert done.exit_code == 2
    assert message in " ".join(done.output.replace("\u2502", " ").split())
    assert not (tmp_path / "out").exists()


def test_a_tunable_gain_is_a_variable_and_the_others_are_constants(tmp_path):
    write_controller(problem_of(PRESSURE), tmp_path, name="law", tunable=["gain"])
    assert replay(tmp_path).returncode == 0
    header = (tmp_path / "law.h").read_text()
    assert "#define LAW_PARAMETERS 1\n" in header
    main = (
        (tmp_path / "main.c")
        .read_text()
        .replace("int k, i;", "int k, i;\n  law_parameters[LAW_PARAMETER_GAIN] *= 2.0;")
    )
    (tmp_path / "main.c").write_text(main)
    done = replay(tmp_path)
    assert done.returncode == 1
    assert int(re.search(r"(\d+) commands differ", done.stdout).group(1)) > 10


def test_a_command_that_is_not_finite_is_reported_and_changes_nothing(tmp_path):
    write_controller(problem_of(PRESSURE), tmp_path, name="law")
    (tmp_path / "main.c").write_text("""
#include "law.h"
#include <math.h>
int main(void) {
  double memory[LAW_MEMORY + 1] = {7.0, 8.0, 9.0, 10.0}, y[] = {NAN, 0.0}, r[] = {2e5, 0.0}, u[] = {0.25, 0.5, 0.0};
  return !(law_step(memory, y, r, u) == 1 && memory[1] == 8.0 && u[0] == 0.25 && u[1] == 0.5);
}
""")
    assert replay(tmp_path).returncode == 0


def test_the_source_allocates_nothing_and_does_not_call_itself(tmp_path):
    write_controller(problem_of(CASCADE, POSITION), tmp_path, name="law")
    source = (tmp_path / "law.c").read_text().split("*/", 1)[1]
    assert not re.search(r"\b(malloc|calloc|realloc|free|goto|while|static double)\b", source)
    assert source.count("law_step(") == 1
    assert source.count("law_sample(") == 2


def predictive_problem(**further):
    """A lift along a position that the predictive controller reaches at the limit of the
    pressure.
    """
    model = linearise(LIFT, LIFT.state_at(pressure=2e5), {"fill": 0.05, "discharge": 0.05})
    one = ("position",)
    law = design_predictive(
        model,
        0.01,
        measured=one,
        controlled=one,
        disturbed=("air_mass",),
        blocks=(1, 2, 4, 8),
        permitted={"position": 1e-3, "speed": 0.1, "fill": 0.1, "discharge": 0.1},
        process_noise={"air_mass": 1e-6, "speed": 0.1, "air_mass.disturbance": 1e-5},
        measurement_noise={"position": 1e-4},
        limits={"pressure": (1e5, 2.2e5)},
        max_rate={"fill": 20.0},
        **further,
    )
    setpoint = Schedule({"position": ((0.0, 0.004), (0.2, 0.02))})
    return Problem(LIFT, ControlLoop(law, 0.01, setpoint), 0.5, LIFT.state_at(pressure=2e5))


def test_a_predictive_controller_in_c_gives_the_commands_of_python(tmp_path):
    """To 1e-9 of their range, with active limits of the inputs, of a column and of a rate; no
    library is needed.
    """
    problem = predictive_problem()
    law = problem.input.controller
    recording = solve(problem).recording
    for name in law.inputs:
        assert np.ptp(recording[f"command.{name}"]) > 0.3
    write_controller(problem, tmp_path, name="law")
    for options in (("-O0",), ("-O2",)):
        done = replay(tmp_path, *options)
        assert done.returncode == 0, done.stdout + done.stderr
        assert re.match(
            r"50 samples, 0 commands differ by more than 1e-09 of their range", done.stdout
        )
    source = (tmp_path / "law.c").read_text()
    tables = re.findall(r"^static (.*?)(?:double|int) law_\w+\[", source, re.MULTILINE)
    assert len(tables) > 15
    assert set(tables) == {"const "}, "a table that takes memory of a microcontroller"
    assert not re.search(r"\b(malloc|calloc|realloc|free\(|goto|while)\b", source.split("*/", 1)[1])


def test_the_header_of_a_predictive_controller_states_its_design(tmp_path):
    """Horizon, weights, limits, noise, model and operating point of the scenario."""
    write_controller(predictive_problem(), tmp_path, name="law")
    header = " ".join((tmp_path / "law.h").read_text().replace("*", " ").split())
    for text in (
        "Horizon: 15 samples of 0.01 s; inputs are held over 1, 2, 4, 8 samples",
        "states air_mass, position, speed; disturbances of the rates of air_mass",
        "Operating point, inputs (SI): fill 0.05, discharge 0.05",
        "(weight 1/d^2) (SI): position 0.001, speed 0.1, fill 0.1, discharge 0.1",
        "Process noise, deviation after 1 s (SI): air_mass 1e-06",
        "Measurement noise (SI): position 0.0001",
        "Greatest rates of inputs, over 1 s (SI): fill 20",
        "Limits of columns (SI): pressure 100000 to 220000, weight of a violation 10000",
    ):
        assert text in header, text


def test_a_predictive_controller_in_c_counts_samples_without_a_solution(tmp_path):
    """A hard limit of the pressure that the start violates: both apply the last plan, or the
    target.
    """
    problem = predictive_problem(slack_weight=float("inf"))
    problem = replace(problem, initial_state=LIFT.state_at(pressure=3e5))
    assert "no solution" in " ".join(solve(problem).recording.notes)
    write_controller(problem, tmp_path, name="law")
    assert replay(tmp_path).returncode == 0


def test_a_predictive_controller_in_single_precision_stays_within_the_stated_tolerance(tmp_path):
    """Its quadratic program converges with the tolerances of floats; also in a library and a sketch
    for Arduino, in C++.
    """
    problem = predictive_problem()
    write_controller(problem, tmp_path, name="law", precision=Single())
    source = re.sub(r"/\*.*?\*/", "", (tmp_path / "law.c").read_text(), flags=re.DOTALL)
    assert "double" not in source
    assert not re.search(r"\b(fabs|fmax|fmin|sqrt)\(|\d\.\d*(e[-+]?\d+)?[,;) ]", source), (
        "a function or number of doubles"
    )
    done = replay(tmp_path, "-O0")
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.match(
        r"50 samples, 0 commands differ by more than 0\.0001 of their range", done.stdout
    )
    library = tmp_path / "library"
    write_controller(problem, library, name="law", precision=Single(), arduino=True)
    assert (library / "src/law.c").read_text() == (tmp_path / "law.c").read_text()
    (sketch,) = library.glob("examples/*/*.ino")
    (library / "sketch.cpp").write_text(
        f"{ARDUINO}{sketch.read_text()}int main() {{ setup(); loop(); }}\n"
    )
    flags = ["-Isrc", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
    subprocess.run([printed.require("g++"), *flags, "sketch.cpp"], cwd=library, check=True)


def test_tolerances_of_doubles_do_not_suit_a_predictive_controller_of_floats(tmp_path, monkeypatch):
    """The export runs the program in single precision, and refuses one whose commands differ."""
    monkeypatch.setattr(printed_predictive, "SINGLE_TOLERANCES", (1e-9, 1e-12, 1e-12, 1e-9))
    with pytest.raises(
        ParameterError, match="LinearModelPredictive in single precision: the command '"
    ):
        write_controller(predictive_problem(), tmp_path, precision=Single())


def test_tunable_parameters_of_a_predictive_controller_are_refused(tmp_path):
    with pytest.raises(
        ParameterError, match="LinearModelPredictive has no tunable parameter 'gain'; leave it out"
    ):
        write_controller(predictive_problem(), tmp_path, tunable=["gain"])


def test_drivers_that_are_not_part_of_the_program_are_named(tmp_path):
    loop = ControlLoop(PRESSURE, 0.02, STEP, drivers={"fill": PWM(50.0)})
    problem = Problem(LIFT, loop, 0.2, LIFT.state_at(pressure=1e5))
    write_controller(problem, tmp_path, name="law")
    assert "Not part of this program: the drivers" in (tmp_path / "law.h").read_text()
    assert "fill: PWM(frequency=50.0" in (tmp_path / "law.h").read_text()


def test_what_cannot_be_printed_is_refused_by_name(tmp_path):
    with pytest.raises(
        ParameterError,
        match=(
            r"Called is a controller in Python and has no printed form\. Derive a law of your own"
            " from ControlLaw"
        ),
    ):
        write_controller(problem_of(Called(PRESSURE)), tmp_path)
    with pytest.raises(ParameterError, match="the problem has no controller to export"):
        write_controller(Problem(LIFT, Schedule({}), 0.1, LIFT.state_at(pressure=1e5)), tmp_path)
    with pytest.raises(
        ParameterError,
        match=r"'measured' is fixed when a program is printed.*tunable parameters are gain",
    ):
        write_controller(problem_of(PRESSURE), tmp_path, tunable=["measured"])
    with pytest.raises(ParameterError, match=r"cannot be the name of an exported program"):
        write_controller(problem_of(PRESSURE), tmp_path, name="switch")
    assert list(tmp_path.iterdir()) == []


def test_the_command_exports_the_controller_of_a_scenario(tmp_path):
    scenario = Path(__file__).parents[2] / "examples" / "pressure_loop.toml"
    done = airmuscle("export", scenario, "--controller", "--to", "c", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    assert {path.name for path in tmp_path.iterdir()} == {
        "pressure_loop.h",
        "pressure_loop.c",
        "main.c",
        "CMakeLists.txt",
    }
    assert "250 samples, 0 commands differ" in replay(tmp_path).stdout
    wrong = airmuscle("export", scenario, "--controller", "--to", "js", "--out", tmp_path)
    assert wrong.exit_code == 2
    assert "a controller is exported to C" in " ".join(wrong.output.replace("\u2502", " ").split())


SENSED_LAWS = {
    "around the law": WithSensors(CASCADE, SENSED, 7.0),
    "within a cascade": Cascade(WithSensors(OUTER, SENSED[:1]), PRESSURE, (0.0,), (5e5,)),
    "around a fault": WithSensors(WithStuckValve(CASCADE, "fill", 0.1, 1.0), SENSED),
    "in a fault": WithStuckValve(WithSensors(CASCADE, SENSED), "fill", 0.1, 1.0),
}


@pytest.mark.parametrize("place", SENSED_LAWS)
def test_simulated_sensors_and_faults_are_not_part_of_a_controller(place, tmp_path):
    """The source is that of the law without them; a real sensor has its own noise and delay."""
    write_controller(problem_of(SENSED_LAWS[place], POSITION), tmp_path / "simulated", name="law")
    write_controller(problem_of(CASCADE, POSITION), tmp_path / "plain", name="law")
    simulated, plain = (
        (tmp_path / folder / "law.c").read_text().split("*/", 1)[1]
        for folder in ("simulated", "plain")
    )
    assert simulated == plain
    header = " ".join((tmp_path / "simulated" / "law.h").read_text().split())
    assert "Not part of this program: simulated sensors and faults of the scenario" in header
    assert "simulated sensors" not in (tmp_path / "plain" / "law.h").read_text()


def test_the_replay_has_the_readings_of_the_sensors_and_the_commands_of_the_run(tmp_path):
    problem = problem_of(SENSED_LAWS["around the law"], POSITION)
    write_controller(problem, tmp_path, name="law")
    main = (tmp_path / "main.c").read_text()
    rows = re.search(r"measured\[SAMPLES\].*? = \{(.*?)\};", main, re.DOTALL).group(1)
    position = np.array([float(row.split(",")[0]) for row in re.findall(r"\{([^{}]*)\}", rows)])
    np.testing.assert_allclose(position / 5e-5, np.round(position / 5e-5), atol=1e-9)
    commands = re.search(r"commands\[SAMPLES\].*? = \{(.*?)\};", main, re.DOTALL).group(1)
    replayed = np.array([float(row.split(",")[0]) for row in re.findall(r"\{([^{}]*)\}", commands)])
    recording = solve(problem).recording
    times = np.searchsorted(recording["time"], 0.005 * np.arange(100) - 1e-9)
    np.testing.assert_allclose(replayed, recording["command.fill"][times], rtol=0, atol=1e-9)


def test_the_controller_of_the_cascade_with_sensors_is_exported_in_single_precision(tmp_path):
    scenario = Path(__file__).parents[2] / "examples" / "joint_cascade.toml"
    options = ["--controller", "--to", "c", "--precision", "float", "--out", str(tmp_path)]
    done = airmuscle("export", scenario, *options)
    assert done.exit_code == 0, done.output
    assert "0 commands differ by more than 0.0001" in replay(tmp_path, "-O0").stdout


ARDUINO = """#include <cstdio>
static unsigned long now;
static unsigned long micros() { return now += 100; }
"""
READ = 'if (scanf("%lf", &measurement[LAW_MEASUREMENT_PRESSURE]) != 1) measurement[0] = 0;'
SHOW = 'printf("%lu %.17g %.17g\\n", now, command[0], command[1]);'


def test_the_arduino_library_commands_what_the_law_commands(tmp_path):
    """The sketch, compiled against a stub of the Arduino functions, with a clock that counts 100 us
    a look.
    """
    write_controller(problem_of(PRESSURE), tmp_path, name="law", arduino=True)
    properties = dict(
        line.split("=", 1) for line in (tmp_path / "library.properties").read_text().splitlines()
    )
    required = {
        "name",
        "version",
        "author",
        "maintainer",
        "sentence",
        "paragraph",
        "category",
        "url",
        "architectures",
    }
    assert required <= set(properties)
    (sketch,) = tmp_path.glob("examples/*/*.ino")
    assert sketch.stem == sketch.parent.name, "the rule of Arduino for sketches"
    text = sketch.read_text().replace("measurement[LAW_MEASUREMENT_PRESSURE] = 0;", READ)
    text = text.replace("(void)command[LAW_COMMAND_FILL];", SHOW)
    (tmp_path / "sketch.cpp").write_text(
        f"{ARDUINO}{text}int main() {{ setup(); while (now < 50000) loop(); }}\n"
    )
    flags = ["-ffp-contract=off", "-Isrc", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(
        [printed.require("gcc"), "-std=c99", *flags, "-c", "src/law.c"], cwd=tmp_path, check=True
    )
    subprocess.run(
        [printed.require("g++"), *flags, "sketch.cpp", "law.o", "-lm", "-o", "sketch"],
        cwd=tmp_path,
        check=True,
    )
    measured = np.linspace(0.5e5, 2e5, 10)
    done = subprocess.run(
        ["./sketch"],
        cwd=tmp_path,
        input="\n".join(map(repr, measured.tolist())),
        capture_output=True,
        text=True,
    )
    rows = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    problem = problem_of(PRESSURE)
    printed_law = print_controller(prepare_loop(problem, problem.input.init(0.0)), "law")
    expected = printed_law.replay(measured[:, None], np.full((10, 1), 1e5))
    assert np.ptp(expected) > 0
    np.testing.assert_array_equal(rows[:, 1:], expected)
    np.testing.assert_allclose(np.diff(rows[:, 0]), 5000, atol=200)


def test_an_arduino_library_contains_a_controller(tmp_path):
    example = Path(__file__).parents[2] / "examples/pressure_loop.toml"
    wrong = airmuscle("export", example, "--to", "arduino", "--out", tmp_path / "a")
    assert "an Arduino library contains a controller; add --controller." in " ".join(
        wrong.output.split()
    )
    right = airmuscle("export", example, "--controller", "--to", "arduino", "--out", tmp_path / "b")
    assert "copy the folder to the libraries of Arduino" in right.output
