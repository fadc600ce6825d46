"""Exported programs: a scenario in C99, JavaScript and Octave makes the steps of the library and
ends where it ends.

What cannot be exported is refused by name; names of users become identifiers; files are complete,
and the same each time.
"""

from __future__ import annotations

import ctypes
import dataclasses
import json
import re
import subprocess
import warnings
from pathlib import Path

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle
from widths import widened

from airmuscle.core import StateVariable, System, autodiff, model, ops, parameter
from airmuscle.engine import (
    DormandPrince8,
    Problem,
    Rodas4,
    RungeKutta4,
    SampledSignal,
    Schedule,
    solve,
)
from airmuscle.errors import AirmuscleWarning, FileError, ParameterError
from airmuscle.files import list_laws, load_law
from airmuscle.outlets import (
    C99,
    JavaScript,
    Octave,
    make_identifiers,
    write_fmu,
    write_law,
    write_program,
)
from airmuscle.outlets.export import build_and_run
from airmuscle.outlets.export.identifiers import LONGEST, RESERVED
from airmuscle.physics import HangingMass, Tabulated
from airmuscle.physics.muscle.characteristic import modes

EXAMPLES = Path(__file__).parents[2] / "examples"
RAMPS = ((0.0, 0.0), (0.1, 0.5), (0.3, 0.1), (0.5, 0.1), (0.7, 0.4))


def problem_of(name, integrator=None, duration=1.0):
    """A run from 1 bar with inputs that ramp."""
    plant = plants.EXAMPLES[name]
    signal = SampledSignal(dict.fromkeys(plant.inputs, RAMPS))
    return Problem(plant, signal, duration, plant.state_at(pressure=1e5), integrator=integrator)


def run_c(folder, *options):
    """Standard error and CSV rows of the exported C program, which is compiled with all warnings as
    errors.
    """
    return printed.finished([printed.built(folder, *options)], folder)


def run_javascript(folder):
    return printed.finished([printed.require("node"), next(folder.glob("*.run.mjs")).name], folder)


def check_run(text, csv, problem):
    """Steps as the library's; the last row to 1e-10 of the greatest value of each column, every row
    to 1e-8: rounding moves the error estimate, and with it the steps, which is less than 1 % of the
    tolerance."""
    solution = solve(problem)
    taken, rejected = map(int, re.search(r"(\d+) steps, (\d+) rejected", text).groups())
    assert (taken, rejected) == (solution.statistics.steps, solution.statistics.rejected_steps)
    header, *rows = csv.splitlines()
    names = [heading.split(" [")[0] for heading in header.split(",")]
    found = np.array([row.split(",") for row in rows], dtype=float)
    expected = np.column_stack([solution.recording[name] for name in names])
    assert found.shape == expected.shape
    scale = np.abs(expected).max(axis=0)
    assert (np.abs(found[-1] - expected[-1]) <= 1e-10 * scale).all()
    assert (np.abs(found - expected) <= 1e-8 * scale).all()


RUN = {C99(): run_c, JavaScript(): run_javascript, Octave(): printed.run_octave}
BUILD_FILES = {"CMakeLists.txt", "package.json"}
"""Files that depend on the name of a program alone."""
TARGETS = pytest.mark.parametrize("target", RUN, ids=lambda target: type(target).__name__)
CASES = {
    "one muscle": ("dmsp-20-300", Rodas4(1e-6)),
    "two muscles on a spool": ("overlap", Rodas4(1e-6)),
    "fixed steps": ("heat", RungeKutta4(1e-2)),
    "fixed steps that the segments are no multiple of": ("heat", RungeKutta4(3e-2)),
    "order eight": ("heat", DormandPrince8(2e-2)),
}


def every_integrator_once(target, case):
    """Each in C; in JavaScript, whose run has the same text, that of variable steps and one of
    fixed steps.
    """
    return (target == C99() and case != "one muscle") or case in (
        "two muscles on a spool",
        "fixed steps that the segments are no multiple of",
    )


@pytest.mark.parametrize(
    ("target", "case"),
    widened(
        [(target, case) for target in (C99(), JavaScript()) for case in CASES],
        every_integrator_once,
    ),
    ids=str,
)
def test_the_program_makes_the_steps_of_the_library(case, target, tmp_path):
    problem = problem_of(*CASES[case])
    write_program(problem, tmp_path, target, name="plant")
    check_run(*RUN[target](tmp_path), problem)


@pytest.mark.parametrize(
    "case", ["one muscle", pytest.param("fixed steps", marks=pytest.mark.slow)]
)
def test_the_octave_program_makes_the_steps_of_the_library(case, tmp_path):
    problem = problem_of(*CASES[case], duration=0.2)
    write_program(problem, tmp_path, Octave(), name="plant")
    check_run(*printed.run_octave(tmp_path), problem)


def test_the_octave_command_writes_its_file_and_displays_nothing(tmp_path):
    write_program(
        problem_of("heat", RungeKutta4(1e-2), duration=0.05), tmp_path, Octave(), name="plant"
    )
    command = [
        printed.require("octave-cli"),
        "--no-init-file",
        "--quiet",
        "--eval",
        "run_plant('run.csv')",
    ]
    assert printed.finished(command, tmp_path)[1] == ""
    assert (tmp_path / "run.csv").read_text().startswith("time [s],")


def end_of(problem, factor=1.0):
    """The states at the end of the library's run from an initial state times a factor."""
    start = {name: value * factor for name, value in problem.initial_state.items()}
    solution = solve(dataclasses.replace(problem, initial_state=start))
    assert solution.status == 0
    return np.array([solution.final_state[s.name] for s in problem.system.states])


@pytest.mark.slow
@pytest.mark.parametrize("name", plants.EXAMPLES)
def test_every_plant_ends_in_c_where_it_ends_in_the_library(name, tmp_path):
    """To 1e-10 of each state, or to the effect of roundings: ten times that of one ulp of the
    initial state.

    A contact amplifies rounding, because it decides whether a step is accepted.
    """
    plant = plants.EXAMPLES[name]
    scale = {
        i.name: 0.01 if "shortening" in i.name else 8e5 if i.unit == "Pa" else 1.0
        for i in plant.input_variables
    }
    signal = SampledSignal({i: tuple((t, v * scale[i]) for t, v in RAMPS) for i in plant.inputs})
    places = {"position": 0.005} if any(s.name == "position" for s in plant.states) else {}
    problem = Problem(plant, signal, 0.5, plant.state_at(pressure=1e5, **places))
    write_program(problem, tmp_path, C99(), name="plant", columns=[s.name for s in plant.states])
    text, csv = run_c(tmp_path)
    assert "time 0.5 s" in text
    found = np.array(csv.splitlines()[-1].split(","), dtype=float)[1:]
    expected = end_of(problem)
    rounding = np.max(
        [np.abs(end_of(problem, 1.0 + k * 2.0**-52) - expected) for k in (-2, -1, 1, 2)], axis=0
    )
    allowed = np.maximum(
        1e-10 * (np.abs(expected) + np.array([s.nominal for s in plant.states])), 10 * rounding
    )
    assert (np.abs(found - expected) <= allowed).all()


def test_jumps_and_a_later_start_are_met(tmp_path):
    plant = plants.EXAMPLES["dmsp-20-300"]
    jumps = Schedule({"fill": ((2.1, 1.0), (2.35, 0.0)), "discharge": ((2.6, 1.0),)})
    problem = Problem(
        plant, jumps, 1.0, plant.state_at(pressure=1e5), start_time=2.0, output_times=0.03
    )
    write_program(problem, tmp_path, C99(), name="plant")
    check_run(*run_c(tmp_path), problem)


@pytest.mark.slow
def test_a_system_without_inputs_is_exported(tmp_path):
    plant = plants.EXAMPLES["closed"]
    problem = Problem(plant, Schedule({}), 0.3, plant.state_at(pressure=1e5, position=0.01))
    for target in (C99(), JavaScript()):
        write_program(problem, tmp_path / type(target).__name__, target, name="plant")
        check_run(*RUN[target](tmp_path / type(target).__name__), problem)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["one muscle", "two muscles on a spool", "fixed steps"])
def test_clang_builds_the_program_as_gcc_does(case, tmp_path):
    problem = problem_of(*CASES[case])
    write_program(problem, tmp_path, C99(), name="plant")
    check_run(*printed.finished([printed.built(tmp_path, compiler="clang")], tmp_path), problem)


@pytest.mark.slow
def test_the_program_has_no_undefined_behaviour(tmp_path):
    write_program(problem_of("overlap", duration=0.2), tmp_path, C99(), name="plant")
    run_c(tmp_path, "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def test_the_sources_are_c_plus_plus_too(tmp_path):
    """The program that g++ builds writes the same numbers as that of gcc, without fused
    operations.
    """
    write_program(problem_of("dmsp-20-300", duration=0.2), tmp_path, C99(), name="plant")
    (tmp_path / "use.cpp").write_text(
        '#include "plant.h"\nint used() { return PLANT_STATE_AIR_MASS + PLANT_INPUT_FILL; }\n'
    )
    options = ["-std=c++17", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off"]
    command = [
        printed.require("g++"),
        *options,
        "-x",
        "c++",
        "plant.c",
        "main.c",
        "use.cpp",
        "-o",
        "program",
        "-lm",
    ]
    printed.finished(command, tmp_path)
    assert printed.finished(["./program"], tmp_path) == run_c(tmp_path, "-ffp-contract=off")


@pytest.mark.parametrize("language", widened(["C", "CXX"], lambda language: language == "CXX"))
def test_cmake_builds_the_program(language, tmp_path):
    problem = problem_of("dmsp-20-300", duration=0.2)
    write_program(problem, tmp_path, C99(), name="plant")
    cmake = printed.require("cmake")
    printed.finished([cmake, "-S", ".", "-B", "build", f"-DLANGUAGE={language}"], tmp_path)
    printed.finished([cmake, "--build", "build"], tmp_path)
    check_run(*printed.finished(["build/plant_run"], tmp_path), problem)


WRONG_ARGUMENTS = {
    "{parameter: {}}": "simulate: there is no 'parameter'; there are parameters, ",
    "{parameters: {'mechanism.inner.mass': 20}}": (
        "parameters: there is no 'mechanism.inner.mass'; there are "
    ),
    "{parameters: [1, 2]}": "parameters: 2 values are given; give ",
    "{parameters: 3}": "parameters: give an array, or values by name.",
    "{parameters: {'mechanism.mass': NaN}}": (
        "parameters: mechanism.mass is NaN; it must be a finite number."
    ),
    "{initial: [1]}": "initial: 1 values are given; give 3: air_mass, position, speed.",
    "{segments: {ends: [1], values: [[0]], slopes: [[0, 0]]}}": (
        "segments, values: 1 values are given; give 2: fill, disc"
    ),
    "{segments: {ends: [1, 2], values: [[0, 0]], slopes: [[0, 0]]}}": (
        "segments: ends, values and slopes must have one el"
    ),
}


def test_javascript_refuses_wrong_arguments_by_name(tmp_path):
    write_program(problem_of("dmsp-20-300", duration=0.1), tmp_path, JavaScript(), name="plant")
    calls = ", ".join(f"() => M.simulate({argument})" for argument in WRONG_ARGUMENTS)
    script = f"""import * as M from "./plant.mjs";
const said = [{calls}].map((call) => {{ try {{ call(); return "nothing"; }} catch (error) {{ return error.name + " " + error.message; }} }});
process.stdout.write(JSON.stringify(said));"""
    messages = printed.run_node(script, None, tmp_path)
    for message, expected in zip(messages, WRONG_ARGUMENTS.values(), strict=True):
        assert message.startswith(f"RangeError {expected}"), message


def test_typescript_knows_the_names_of_the_module(tmp_path):
    """Checked by the compiler where it is installed; the package is one that npm and bundlers
    resolve.
    """
    write_program(problem_of("dmsp-20-300", duration=0.1), tmp_path, JavaScript(), name="plant")
    package = json.loads((tmp_path / "package.json").read_text())
    assert all((tmp_path / path).exists() for path in package["exports"]["."].values())
    types = (tmp_path / "plant.d.mts").read_text()
    assert 'export type State = "air_mass" | "position" | "speed";' in types
    (tmp_path / "use.mts").write_text(
        'import {simulate} from "./plant.mjs";\n'
        'const run = simulate({parameters: {"mechanism.mass": 12}, initial: {position: 0.01}});\n'
        "export const last: number | undefined = run.columns.position.at(-1);\n"
    )
    options = ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext"]
    printed.finished([printed.require("tsc"), *options, "use.mts"], tmp_path)
    (tmp_path / "use.mts").write_text(
        'import {simulate} from "./plant.mjs";\nsimulate({parameters: {mass: 12}});\n'
    )
    done = subprocess.run(
        ["tsc", *options, "use.mts"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode != 0
    assert "'mass' does not exist" in done.stdout


@TARGETS
def test_constants_take_the_place_of_parameters_that_are_not_tunable(target, tmp_path):
    problem = problem_of("dmsp-20-300", duration=0.2)
    write_program(problem, tmp_path / "all", target, name="plant")
    write_program(problem, tmp_path / "one", target, name="plant", tunable=["mechanism.mass"])
    check_run(*RUN[target](tmp_path / "one"), problem)
    source = {".mjs": "plant.mjs", ".c": "plant.c", ".m": "plant.m"}
    [name] = [n for n in source.values() if (tmp_path / "one" / n).exists()]
    whole, less = ((tmp_path / f / name).read_text() for f in ("all", "one"))
    assert len(less) < len(whole)
    assert [
        text.count("'mechanism.mass'") + text.count('"mechanism.mass"') for text in (whole, less)
    ] == [1, 1]
    assert [
        text.count("'mechanism.gravity'") + text.count('"mechanism.gravity"')
        for text in (whole, less)
    ] == [1, 0]


def test_a_tunable_parameter_changes_the_run(tmp_path):
    """JavaScript: a heavier mass as an argument of `simulate`, against the heavier plant of the
    library.
    """
    problem = problem_of("dmsp-20-300", duration=0.2)
    heavier = dataclasses.replace(
        problem, system=dataclasses.replace(problem.system, mechanism=HangingMass(12.0))
    )
    write_program(problem, tmp_path, JavaScript(), name="plant", tunable=["mechanism.mass"])
    script = (
        'import {simulate} from "./plant.mjs";\nconsole.log(JSON.stringify(simulate({parameters:'
        " [12.0]}).columns.position));"
    )
    found = np.array(printed.run_node(script, {}, tmp_path))
    expected = solve(heavier).recording["position"]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


# Laws


def closed_form_laws():
    """The laws of the library in closed form, by name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        laws = {name: load_law(name).characteristic for name in list_laws()}
    return {name: law for name, law in laws.items() if law.traceable}


def law_points(law, count=40):
    """Points of the two arguments of the closed form of a law."""
    rng = np.random.default_rng(3)
    pressure = rng.uniform(6e4, 5e5, count)
    contraction = rng.uniform(0.005, 0.16, count)  # within the range of every law
    force = rng.uniform(1, 500, count)
    if law.refuses_beyond and hasattr(law, "contraction"):  # the surface of Borzikova
        pressure = rng.uniform(1e4, 3.5e5, count)
        force = rng.uniform(45.0, 260.0, count)
    for method, (a, b) in {
        "force": (pressure, contraction),
        "contraction": (pressure, force),
        "pressure": (contraction, force),
    }.items():
        base = {"force": "ForceLaw", "contraction": "ContractionLaw", "pressure": "PressureLaw"}[
            method
        ]
        if base in {cls.__name__ for cls in type(law).__mro__}:
            return method, a, b
    raise AssertionError(type(law))


def law_values(law):
    """Value and derivatives (N, 3) that a law answers; of a force law the stiffness. A law that is
    solved for the pressure or the contraction is printed as its formula.
    """
    method, a, b = law_points(law)
    if method == "force":
        slopes = law.slopes(a, b)
        np.testing.assert_allclose(-slopes.by_contraction, law.stiffness(a, b), rtol=1e-13)
        return np.column_stack([law.force(a, b), slopes.by_pressure, -slopes.by_contraction])
    with modes.formula_alone():
        slopes = [autodiff.derivative(law, method, a, b, wrt=i) for i in range(2)]
        return np.column_stack([getattr(law, method)(a, b), *slopes])


def test_every_closed_form_law_has_its_value_and_slopes_in_javascript(tmp_path):
    printed.require("node")
    data = {}
    for i, law in enumerate(closed_form_laws().values()):
        write_law(law, tmp_path, JavaScript(), name=f"law{i}")
        data[f"law{i}"] = np.column_stack(law_points(law)[1:]).tolist()
    script = """
import {readFileSync} from "fs";
const found = {};
for (const [name, points] of Object.entries(JSON.parse(readFileSync("data.json")))) {
  const {law, results} = await import(`./${name}.mjs`);
  found[name] = points.map(([a, b]) => { const at = law(a, b); return results.map((r) => at[r]); });
}
console.log(JSON.stringify(found));
"""
    found = printed.run_node(script, data, tmp_path)
    worst = {
        name: printed.deviation(np.array(found[f"law{i}"], dtype=float), law_values(law))
        for i, (name, law) in enumerate(closed_form_laws().items())
    }
    assert {name: d for name, d in worst.items() if not d < 1e-12} == {}


def test_every_closed_form_law_has_its_value_and_slopes_in_c(tmp_path):
    sources = []
    for i, law in enumerate(closed_form_laws().values()):
        write_law(law, tmp_path, C99(), name=f"law{i}")
        sources.append(f'#include "law{i}.c"')
    library = printed.shared_library("\n".join([*sources, ""]), tmp_path, "laws", "-O0")
    for i, (name, law) in enumerate(closed_form_laws().items()):
        _, a, b = law_points(law)
        c = np.zeros(500)
        defaults = (ctypes.c_double * 500).in_dll(library, f"law{i}_defaults")
        getattr(library, f"law{i}_prepare")(defaults, ctypes.c_void_p(c.ctypes.data))
        rows = np.empty((a.size, 3))
        for row, x, y in zip(rows, a.tolist(), b.tolist(), strict=True):
            printed.call(getattr(library, f"law{i}_evaluate"), x, y, c, row)
        assert printed.deviation(rows, law_values(law)) < 1e-12, name
        for row, point in zip(rows, ((np.nan, b[0]), (a[0], np.nan)), strict=False):
            printed.call(getattr(library, f"law{i}_evaluate"), *point, c, row)
            assert np.isnan(row).all(), f"{name} gives a value at a missing argument"


def test_a_printed_force_law_has_the_force_beyond_its_range(tmp_path):
    """A stretched sleeve, a slack muscle, and the limit of the force, as in calls with numbers."""
    laws = {
        name: law
        for name, law in closed_form_laws().items()
        if law_points(law)[0] == "force" and not law.refuses_beyond
    }
    sources = []
    for i, law in enumerate(laws.values()):
        write_law(law, tmp_path, C99(), name=f"law{i}")
        sources.append(f'#include "law{i}.c"')
    library = printed.shared_library("\n".join([*sources, ""]), tmp_path, "beyond", "-O0")
    rng = np.random.default_rng(7)
    pressure = rng.uniform(0.0, 12e5, 60)
    contraction = rng.uniform(-0.05, 0.45, 60)
    assert len(laws) > 3
    for i, (name, law) in enumerate(laws.items()):
        c = np.zeros(500)
        defaults = (ctypes.c_double * 500).in_dll(library, f"law{i}_defaults")
        getattr(library, f"law{i}_prepare")(defaults, ctypes.c_void_p(c.ctypes.data))
        rows = np.empty((pressure.size, 3))
        for row, x, y in zip(rows, pressure.tolist(), contraction.tolist(), strict=True):
            printed.call(getattr(library, f"law{i}_evaluate"), x, y, c, row)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AirmuscleWarning)
            expected = law.force(pressure, contraction)
        assert expected.max() > 0.0
        np.testing.assert_allclose(rows[:, 0], expected, rtol=1e-11, atol=1e-8, err_msg=name)


def test_a_law_in_octave_takes_arrays(tmp_path):
    law = load_law("dmsp-20-300").characteristic
    write_law(law, tmp_path, Octave(), name="festo")
    script = "[f, s, k] = festo(3e5, [0.05; 0.1; 0.15; NaN]); printf('%.17g ', [f, s, k]');"
    done = subprocess.run(
        [printed.require("octave-cli"), "--no-init-file", "--quiet", "--eval", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    found, missing = np.split(np.array(done.stdout.split(), dtype=float).reshape(4, 3), [3])
    assert np.isnan(missing).all()
    contraction = np.array([0.05, 0.1, 0.15])
    slopes = law.slopes(3e5, contraction)
    expected = np.column_stack(
        [law.force(3e5, contraction), slopes.by_pressure, -slopes.by_contraction]
    )
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@TARGETS
def test_a_law_without_closed_form_is_refused_by_name(target, tmp_path):
    table = Tabulated((0.0, 0.0, 1e5, 1e5), (0.0, 0.1, 0.0, 0.1), (10.0, 0.0, 100.0, 50.0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        exact = load_law("saga2007-exact").characteristic
    for law in (table, exact):
        kind = type(law).__name__
        with pytest.raises(
            ParameterError,
            match=rf"{kind} has no closed form .* as_force_law\(law, validity_range\)",
        ):
            write_law(law, tmp_path / "law", target)
    assert not (tmp_path / "law").exists()


# Names, provenance and files


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("left.pressure", "left_pressure"),
        ("épaule gauche", "epaule_gauche"),
        ("筋", "u7B4B"),
        ("α-muscle", "u3B1_muscle"),
        ("3 kg", "n_3_kg"),
        ("_x__y_", "x_y"),
        ("", "n"),
        ("while", "while_"),
        ("End", "End_"),
        ("NUL", "NUL_"),
        ("*/ int x;", "int_x"),
        ("a\nb", "a_b"),
        ("../../etc", "etc"),
        ("\ud800", "n"),
    ],
)
def test_a_name_becomes_an_identifier(name, expected):
    assert make_identifiers([name]) == (expected,)


def test_one_text_is_no_sequence_of_names_and_many_equal_names_are_numbered():
    with pytest.raises(ParameterError, match="takes a sequence of names, not the text"):
        make_identifiers("x" * 100_000)
    words = make_identifiers(["x"] * 20_000)
    assert (words[0], words[1], words[-1]) == ("x", "x_2", "x_20000")


def test_identifiers_are_distinct_in_any_case_and_of_limited_length():
    names = [
        "a.b",
        "a_b",
        "A b",
        "x" * 300,
        "x" * 299 + "y",
        "X" * 300,
        *(["same"] * 30),
        "same_2",
        "µ",
        "μ",
    ]
    words = make_identifiers(names)
    assert len({word.casefold() for word in words}) == len(names)
    assert all(re.fullmatch(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*_?", word) for word in words)
    assert max(map(len, words)) <= LONGEST
    assert not RESERVED.intersection(words)
    assert make_identifiers(names) == words
    assert all(make_identifiers([word]) == (word,) for word in words)


@pytest.mark.slow
def test_names_of_users_cannot_leave_their_text(tmp_path):
    """Quotes, comment ends, keywords, trigraphs and other alphabets in the name of a muscle, in
    every language.
    """
    names = ('*/ "\\', "while'??/", "筋肉 % \u2028")
    base = plants.EXAMPLES["joint with stops"]
    for left in names:
        muscles = tuple(
            dataclasses.replace(m, name=n)
            for m, n in zip(base.muscles, (left, "right"), strict=True)
        )
        plant = dataclasses.replace(base, muscle=muscles)
        problem = Problem(plant, Schedule({}), 0.02, plant.state_at(pressure=1e5))
        for target in (C99(), JavaScript()):
            folder = tmp_path / f"{names.index(left)}{type(target).__name__}"
            write_program(problem, folder, target, name="plant", title=f"{left} */ \n int x; \\")
            _, csv = RUN[target](folder)
            assert len(csv.splitlines()) > 3


@model
class Named(System):
    """A system whose names are those of arguments, values and keywords of the printed functions."""

    c: float = parameter("1/s", "c", "ends a comment */ with ??/", bounds=(0.0, 10.0))
    v2: float = parameter("1", "v2", "number of a value", bounds=(0.0, 10.0))
    states = (StateVariable("x", "m", 1.0, "argument"), StateVariable("v1", "m", 1.0, "value"))
    inputs = ("double",)

    def rates(self, state, inputs):
        return {
            "x": self.v2 * state["v1"] - self.c * state["x"],
            "v1": inputs["double"] - self.c * state["v1"],
        }

    def outputs(self, state, inputs):
        return {"f": ops.exp(-self.c * state["x"]), "x_rate": state["v1"]}


@pytest.mark.parametrize("target", [C99(), JavaScript()], ids=str)
def test_names_of_quantities_do_not_collide_with_those_of_the_program(target, tmp_path):
    problem = Problem(Named(2.0, 0.5), SampledSignal({"double": RAMPS}), 1.0, {"x": 0.1, "v1": 0.0})
    write_program(problem, tmp_path, target, name="plant")
    check_run(*RUN[target](tmp_path), problem)


@pytest.mark.parametrize(
    ("target", "lines"),
    [
        (
            C99(),
            (
                "const double speed = x[2];  /* [m/s] speed of the load */",
                "/* [Pa] gauge pressure in the muscle */",
            ),
        ),
        (
            JavaScript(),
            (
                "const speed = x[2];  // [m/s] speed of the load",
                "// [Pa] gauge pressure in the muscle",
            ),
        ),
        (
            Octave(),
            ("  speed = x(3);  % [m/s] speed of the load", "% [Pa] gauge pressure in the muscle"),
        ),
    ],
    ids=str,
)
def test_printed_functions_name_the_quantities_of_the_model(target, lines, tmp_path):
    """States, inputs, parameters, rates and outputs, each with its unit and its meaning, wherever
    they are computed.
    """
    write_program(problem_of("dmsp-20-300"), tmp_path, target, name="plant")
    (text,) = (
        path.read_text()
        for path in tmp_path.iterdir()
        if path.name in ("plant.c", "plant.mjs", "plant.m")
    )
    before, rates = re.split(r"(?:void|function) .*rhs\(", text)
    rates = re.split(r"(?:void|function) .*jac\(", rates)[0]
    for line in (
        *lines,
        "mechanism_gravity = c",
        "force = ",
        "contraction = ",
        "air_mass_rate = ",
        "[kg/s]",
    ):
        assert line in rates, line
    assert "mechanism_mass = p" in before


@TARGETS
def test_every_file_states_where_it_comes_from(target, tmp_path):
    problem = problem_of("dmsp-20-300")
    for path in write_program(problem, tmp_path, target, name="plant", title="A title"):
        if path.name in BUILD_FILES:
            continue
        text = path.read_text()
        assert re.search(r"Exported by airmuscle \d+\.\d+\.\d+\.", text), path
        assert re.search(r"SHA-256 of the model: [0-9a-f]{64}", text)
        assert "BSD-3-Clause" in text
        assert "mechanism.mass = 10.0 kg" in text
        assert "Hairer" in text
        assert "Martens" in text


@TARGETS
def test_files_are_the_same_every_time_and_change_with_the_model(target, tmp_path):
    def contents(folder, problem):
        paths = write_program(problem, tmp_path / folder, target, name="plant")
        return [path.read_bytes() for path in paths if path.name not in BUILD_FILES]

    first = contents("a", problem_of("dmsp-20-300"))
    second = contents("b", problem_of("dmsp-20-300"))
    assert first == second
    base = problem_of("dmsp-20-300")
    heavier = dataclasses.replace(
        base, system=dataclasses.replace(base.system, mechanism=HangingMass(10.000001))
    )
    assert all(a != b for a, b in zip(first, contents("c", heavier), strict=True))


def test_a_target_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("here")
    with pytest.raises(
        FileError, match=r"file: cannot be written to: .* Specify a folder with write permission"
    ):
        write_program(problem_of("dmsp-20-300"), tmp_path / "file", C99())


@pytest.mark.parametrize(
    ("last", "write"),
    [
        ("main.c", lambda problem, folder: write_program(problem, folder, C99())),
        (
            "plant.fmu",
            lambda problem, folder: write_fmu(problem, folder / "plant.fmu", binary=False),
        ),
    ],
)
def test_a_full_target_is_named_and_nothing_half_written_is_left(
    last, write, tmp_path, monkeypatch
):
    written = Path.write_bytes

    def full(path, data):
        if path.name == last:
            raise OSError(28, "No space left on device")
        return written(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    problem = problem_of("dmsp-20-300")
    with pytest.raises(
        FileError,
        match=r"new: cannot be written to: No space left on device\. Free space there, or",
    ):
        write(problem, tmp_path / "new")
    assert not (tmp_path / "new").exists()


# What is refused


@pytest.mark.parametrize(
    ("tunable", "message"),
    [
        (
            "mechanism.mas",
            r"Plant has no parameter 'mechanism\.mas'.*Did you mean 'mechanism\.mass'\?",
        ),
        ("circuit.segment_count", "has no parameter"),
        (
            "mechanism",
            "'mechanism' is fixed when a program is printed, because it determines the equations",
        ),
        ("muscle.name", "'muscle.name' is fixed when a program is printed"),
    ],
)
def test_a_parameter_that_cannot_be_tunable_is_refused(tunable, message, tmp_path):
    with pytest.raises(ParameterError, match=message):
        write_program(problem_of("dmsp-20-300"), tmp_path, C99(), tunable=[tunable])


@pytest.mark.parametrize("name", ["while", "2x", "a b", "a__b", "x" * 300, "../up", "π"])
def test_a_name_that_is_no_identifier_is_refused_with_one_that_is(name, tmp_path):
    with pytest.raises(
        ParameterError, match=r"cannot be the name of an exported program.* Use '\w+'\."
    ) as caught:
        write_program(problem_of("dmsp-20-300"), tmp_path, C99(), name=name)
    remedy = re.search(r"Use '(\w+)'", str(caught.value)).group(1)
    assert write_program(problem_of("dmsp-20-300"), tmp_path, C99(), name=remedy)


def test_an_unknown_column_is_refused_with_the_nearest(tmp_path):
    with pytest.raises(ParameterError, match=r"no column 'presure'.*Did you mean 'pressure'"):
        write_program(problem_of("dmsp-20-300"), tmp_path, C99(), columns=["presure"])


# The command


def test_the_command_writes_a_program_that_runs(tmp_path):
    done = airmuscle("export", EXAMPLES / "fill_discharge.toml", "--to", "c", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    assert {path.name for path in tmp_path.iterdir()} == {
        "fill_discharge.h",
        "fill_discharge.c",
        "main.c",
        "CMakeLists.txt",
    }
    assert "cc -O2 fill_discharge.c main.c -lm -o run && ./run run.csv" in done.output
    text, csv = run_c(tmp_path)
    assert "416 steps" in text
    assert csv.startswith("time [s],air_mass [kg],")


def test_the_command_exports_a_law(tmp_path):
    done = airmuscle("export", "dmsp-20-300", "--law", "--to", "js", "--out", tmp_path, "--json")
    assert done.exit_code == 0, done.output
    assert [path.name for path in tmp_path.iterdir()] == ["dmsp_20_300.mjs"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--to", "fortran"), "--to is 'fortran'; allowed range: c, js, octave"),
        (("--to", "c", "--law", "--tunable", "x"), "all parameters of a law can be changed"),
    ],
)
def test_the_command_refuses_a_wrong_use(arguments, message, tmp_path):
    done = airmuscle("export", "dmsp-20-300", *arguments, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert message in " ".join(done.output.replace("│", " ").split())
    assert not (tmp_path / "out").exists()


def test_the_command_builds_and_runs_the_program(tmp_path):
    printed.require("gcc")
    done = airmuscle(
        "export", EXAMPLES / "fill_discharge.toml", "--to", "c", "--out", tmp_path, "--build"
    )
    assert done.exit_code == 0, done.output
    assert re.search(
        r"program: 2501 rows; 416 steps, \d+ rejected, time 25 s; code \d+ bytes", done.output
    )
    assert {path.suffix for path in tmp_path.iterdir()} == {".c", ".h", ".txt"}


def test_without_a_compiler_it_says_what_can_be_done(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    done = airmuscle(
        "export",
        EXAMPLES / "fill_discharge.toml",
        "--to",
        "c",
        "--out",
        tmp_path / "out",
        "--build",
    )
    assert done.exit_code == 1
    message = (
        r"no C compiler \(gcc, clang, cc\) was found\. The sources are in .*out; install gcc or"
        r" clang, or compile"
    )
    assert re.search(message, done.stderr), done.stderr
    assert (tmp_path / "out" / "main.c").exists()


def test_a_failing_compiler_is_quoted(tmp_path):
    printed.require("gcc")
    (tmp_path / "main.c").write_text("int main(void) { return undeclared; }\n")
    with pytest.raises(FileError, match=r"cc failed with exit code 1: .*undeclared"):
        build_and_run([tmp_path / "main.c"])
