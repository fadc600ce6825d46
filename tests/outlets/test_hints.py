"""A hint names an argument that Python takes; the command line writes it as its option, or omits it
if it has none.

Texts that are joined, prefixed, stored in results or pickled keep their hints.
"""

from __future__ import annotations

import ast
import copy
import importlib
import inspect
import itertools
import json
import pickle
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import airmuscle

import airmuscle as am
from airmuscle.bench import (
    DropMissing,
    Huber,
    LevelSplit,
    NoTime,
    RunSplit,
    bootstrap,
    compare,
    find_loops,
    fit,
    fit_loop,
    read,
    read_csv,
    standard_candidates,
    write,
)
from airmuscle.bench.statics import blank_surface
from airmuscle.core import Diagnostic, DiagnosticCode, Hint, HintedText
from airmuscle.errors import ColumnError, SimulationError
from airmuscle.files.library import located_errors
from airmuscle.outlets.cli import COMMANDS, INSTRUCTIONS, in_options
from airmuscle.physics import Sarosi2012
from airmuscle.recording import Recording

SOURCE = Path(am.__file__).parent
SAROSI = Sarosi2012(1.2e-4, 420.0, -57.0, -8.7e-3, 2.7e-3, -310.0)
SURFACE = ("--characteristic", "ContractileSurface", "--degree")
VALUES = {
    "fixed": ("wall_thickness",),
    "sigma": 1.0,
    "by": LevelSplit("contraction"),
    "leave_out": LevelSplit("pressure"),
    "units": {"pressure": ...},
    "columns": {1: "pressure [kPa]"},
    "decimal": ",",
    "resting_length": ...,
    "ambient": ...,
    "constants": {"length": "73.2 mm"},
    "file_name": "held{length [mm]}",
    "time": NoTime(),
    "degree": 2,
    "skip_rows": 1,
    "drop_outliers": True,
    "loss": Huber(10.0),
    "missing": DropMissing((-999.0,)),
    "displacement_zero": "12 mm",
    "all_rows": True,
    "grid": "force [N] over contraction [%], pressure [kPa]",
    "law": ...,
    "censoring": ...,
    "free": ("circuit.fill.conductance",),
    "": ...,
    "spreads": ("mechanism.mass=20 %",),
    "rig": ...,
}
"""A value of every argument that a hint of the source names."""


def in_one_line(text: str) -> str:
    return " ".join(text.split())


# All hints of the source


def source_hints() -> Iterator[tuple[str, str, str]]:
    """(place, argument, function) of every hint that is created in the package."""
    for path in sorted(SOURCE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if "Hint(" in source else ():
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id == "Hint"
            ):
                given = dict(zip(Hint.__match_args__, node.args, strict=False))
                given |= {str(keyword.arg): keyword.value for keyword in node.keywords}
                texts = {
                    name: ast.literal_eval(given[name])
                    for name in ("argument", "function")
                    if name in given
                }
                yield (
                    f"{path.name}:{node.lineno}",
                    texts.get("argument", ""),
                    texts.get("function", ""),
                )


HINTS = list(source_hints())


def public_functions() -> dict[str, Callable[..., Any]]:
    """All functions and classes of the faces, by module and name."""
    faces = [
        am,
        *(
            importlib.import_module(".".join(["airmuscle", *path.parent.relative_to(SOURCE).parts]))
            for path in SOURCE.rglob("__init__.py")
            if path.parent != SOURCE
        ),
    ]
    names = [(face, name) for face in faces for name in getattr(face, "__all__", ())]
    things = {
        f"{face.__name__}.{name}".removeprefix("airmuscle."): getattr(face, name)
        for face, name in names
    }
    things |= {
        f"characteristic.{name}": getattr(am.characteristic, name)
        for name in am.characteristic.__all__
    }
    return {
        name: thing
        for name, thing in things.items()
        if inspect.isroutine(thing)
        or (inspect.isclass(thing) and not issubclass(thing, BaseException))
    }


def test_there_is_a_hint_for_every_remedy_and_a_value_for_every_hint():
    assert len(HINTS) >= 15
    assert {argument for _, argument, _ in HINTS} == set(VALUES)
    remedies = {argument or function for _, argument, function in HINTS}
    assert remedies == {key for table in INSTRUCTIONS.values() for key in table}


@pytest.mark.parametrize(
    ("place", "argument", "function"), HINTS, ids=[place for place, _, _ in HINTS]
)
def test_every_hint_names_an_argument_of_a_public_function(
    place: str, argument: str, function: str
):
    functions = public_functions()
    owner, _, method = function.rpartition(".")
    known = functions.get(function) or getattr(functions.get(owner), method, None)
    assert not function or known
    asked = [known] if known else list(functions.values())
    assert not argument or any(
        argument in inspect.signature(each).parameters for each in asked if not _is_enum(each)
    )


def _is_enum(thing: object) -> bool:
    return isinstance(thing, type) and hasattr(thing, "__members__")


@pytest.mark.parametrize("command", INSTRUCTIONS)
def test_every_instruction_names_options_that_its_command_has(command: str):
    options = set(re.findall(r"--[a-z-]+", airmuscle(command, "--help").output))
    for key, instruction in INSTRUCTIONS[command].items():
        argument = "" if key not in VALUES else key
        for constant in ("", "UNCENSORED") if key == "censoring" else ("",):
            text = instruction(Hint("To do it", argument, VALUES[argument], constant=constant))
            assert set(re.findall(r"--[a-z-]+", text)) <= options, text
            assert set(re.findall(r"`airmuscle ([a-z-]+)", text)) <= {row.name for row in COMMANDS}
            assert command == "fit-dynamic" or "`" in text or "--" in text


# The texts


def test_a_hint_is_a_sentence_in_python():
    assert str(Hint("To fix one", "fixed", ("a",))) == "To fix one, use fixed=('a',)."
    assert str(Hint("To fix one", "fixed")) == "To fix one, use fixed=...."
    assert str(Hint("To leave out levels", "leave_out", LevelSplit("pressure"))).endswith(
        "LevelSplit('pressure')."
    )
    assert str(Hint("To leave out levels", "by", LevelSplit("force", 0.1))).endswith(
        "LevelSplit('force', min_gap=0.1)."
    )
    assert str(Hint("To state it", "resting_length", "300 mm", "read")).endswith(
        "resting_length='300 mm' of read."
    )


TEXT = HintedText(
    "a: ", HintedText("no unit.", Hint("To state it", "units", {"force": ...})), "\nb: wrong."
)


@pytest.mark.parametrize("same", [copy.deepcopy, lambda text: pickle.loads(pickle.dumps(text))])
def test_a_text_with_hints_is_a_string_that_keeps_them(same: Callable[[HintedText], HintedText]):
    assert TEXT == "a: no unit. To state it, use units={'force': ...}.\nb: wrong."
    assert (
        in_options(same(TEXT), "fit")
        == "a: no unit. To state it, use --unit 'force=...'.\nb: wrong."
    )
    assert (
        in_options(same(TEXT), "evaluate")
        == in_options(same(TEXT), None)
        == "a: no unit.\nb: wrong."
    )
    assert json.loads(json.dumps(TEXT)) == str(TEXT)


def test_an_error_keeps_its_hint_where_a_location_is_added():
    hint = Hint("To state it", "units", {"force": ...})
    with pytest.raises(ColumnError) as caught, located_errors("study.toml"):
        raise ColumnError("no \x1b unit.", hint=hint)
    error = pickle.loads(pickle.dumps(caught.value))
    assert str(error) == "study.toml: no \\x1b unit. To state it, use units={'force': ...}."
    assert error.hint == hint
    assert (
        in_options(error.message, "inspect")
        == "study.toml: no \\x1b unit. To state it, use --unit 'force=...'."
    )
    assert ColumnError("no unit").hint is None


def test_an_error_of_a_simulation_keeps_its_results_where_a_location_is_added():
    results = object()
    with (
        pytest.raises(SimulationError, match=r"^here: it ended\.$") as caught,
        located_errors("here"),
    ):
        raise SimulationError("it ended.", results, interrupted=True)
    assert caught.value.solution is results
    assert caught.value.interrupted


def test_a_diagnostic_may_have_a_hint_of_either_kind():
    code = DiagnosticCode.MODEL
    hint = Hint("To fix one", "fixed", ("a",))
    assert str(Diagnostic(code, "run", "it ended", hint="Begin again.")) == "it ended. Begin again."
    assert (
        in_options(Diagnostic(code, "run", "it ended", hint=hint).message, "fit")
        == "it ended. To fix one, use --fix 'a'."
    )


# Every case: the error in Python, and the message of the command line


def table(path: Path, *, resting_length: float | None = None, **columns: np.ndarray) -> Path:
    constants = {} if resting_length is None else {"resting_length": resting_length}
    write(Recording(columns, path.name, constants), path)
    return path


def points(path: Path, count: int = 120, zero: bool = False) -> Path:
    rng = np.random.default_rng(1)
    pressure = np.repeat(np.linspace(1e5, 6e5, 6), count // 6)
    contraction = rng.uniform(0.0, 0.2, count // 6 * 6)
    force = SAROSI.force(pressure, contraction) + 30.0 * rng.standard_normal(pressure.size)
    return table(
        path,
        pressure=pressure,
        contraction=contraction,
        force=0.0 * force if zero else np.maximum(force, 0.0),
    )


def sweep(
    path: Path,
    ends: tuple[float, ...],
    pressures: tuple[float, ...],
    resting_length: float | None = None,
) -> Path:
    contraction, pressure = (
        np.concatenate([np.linspace(a, b, 60) for a, b in itertools.pairwise(x)])
        for x in (ends, pressures)
    )
    force = SAROSI.force(pressure, contraction) + 300.0
    columns = {
        "time": np.arange(force.size) * 0.2,
        "pressure": pressure,
        "contraction": contraction,
        "force": force,
    }
    return table(path, resting_length=resting_length, **columns)


def text_file(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def loops(file: Path) -> Any:
    return [fit_loop(loop) for loop in find_loops(read(file))]


def law(degree: int) -> Any:
    return blank_surface(degree, 1e4)


def ranked(file: Path) -> Any:
    runs = read(file)
    return compare(runs, standard_candidates(runs)[:1], leave_out=RunSplit())


NO_UNIT = "pressure,contraction [%],force [N]\n1,2,3\n2,3,4\n"
NO_HEADINGS = "1;2;3\n2;3;4\n"
THOUSANDS = "pressure [kPa];contraction [%];force [N]\n100;5;1,234\n200;6;0.5\n"
RISE_AND_FALL = (0.0, 0.15, 0.0)
CASES: dict[
    str, tuple[Callable[[Path], Path], Callable[[Path], Any], tuple[Any, ...], str, str]
] = {
    "greatest degree of a surface": (
        points,
        lambda file: fit(law(9), read(file)),
        ("fit", *SURFACE, 9),
        "use degree=5 of characteristic.ContractileSurface.blank.",
        "For the greatest degree that the levels determine, use --degree 5.",
    ),
    "parameters fixed": (
        lambda path: points(path, 30),
        lambda file: fit(law(9), read(file)),
        ("fit", *SURFACE, 9),
        "use fixed=....",
        "To fix parameters, use --fix PARAMETER.",
    ),
    "slack in every row": (
        lambda path: points(path, zero=True),
        lambda file: fit(law(2), read(file)),
        ("fit", *SURFACE, 2),
        "To state the unit, use units={'force': ...} of ColumnMapping.",
        "To state the unit, use --unit 'force=...'.",
    ),
    "levels drawn": (
        points,
        lambda file: bootstrap(fit(law(2), read(file)), read(file), by=RunSplit()),
        ("fit", *SURFACE, 2, "--bootstrap", 50, "--leave-out", "run"),
        "use by=LevelSplit('contraction').",
        "To resample by levels of contraction, use --leave-out contraction.",
    ),
    "levels left out": (
        points,
        ranked,
        ("fit", "--compare", "--leave-out", "run"),
        (
            "use leave_out=LevelSplit('contraction'). To leave out levels of pressure, use"
            " leave_out=LevelSplit('pressure')."
        ),
        (
            "To leave out levels of contraction, use --leave-out contraction. "
            "To leave out levels of pressure, use --leave-out pressure."
        ),
    ),
    "no unit": (
        lambda path: text_file(path, NO_UNIT),
        read_csv,
        ("fit", *SURFACE, 1),
        "use units={'pressure': ...} of ColumnMapping.",
        "To state the unit, use --unit 'pressure=...'.",
    ),
    "no headings": (
        lambda path: text_file(path, NO_HEADINGS),
        read,
        ("hysteresis",),
        "use columns={1: 'pressure [kPa]', 2: 'force [N]'} of ColumnMapping.",
        'use --column "1=pressure [kPa]" --column "2=force [N]".',
    ),
    "no headings, inspected": (
        lambda path: text_file(path, NO_HEADINGS),
        read,
        ("inspect",),
        "use columns={1: 'pressure [kPa]', 2: 'force [N]'} of ColumnMapping.",
        'use --column "1=pressure [kPa]" --column "2=force [N]".',
    ),
    "ambiguous decimal sign": (
        lambda path: text_file(path, THOUSANDS),
        read,
        ("fit", *SURFACE, 1),
        "use decimal=',' of ColumnMapping.",
        "To specify the decimal sign, use --decimal ','.",
    ),
    "no resting length": (
        lambda path: sweep(path, RISE_AND_FALL, (3e5, 3e5, 3e5)),
        loops,
        ("hysteresis",),
        "use resting_length=... of ColumnMapping.",
        'To state it, use --resting-length "...".',
    ),
    "one branch": (
        lambda path: sweep(path, (0.0, 0.15), (3e5, 3e5), 0.3),
        loops,
        ("hysteresis",),
        "use all_rows=True.",
        "To fit all rows, if only the length changes quickly, use --all-rows.",
    ),
    "pressure and length together": (
        lambda path: sweep(path, RISE_AND_FALL, (1e5, 6e5, 1e5)),
        loops,
        ("hysteresis",),
        "use law=....",
        "use --muscle NAME with --use-characteristic.",
    ),
}
"""File, call in Python, arguments of the command; the remedy in Python and on the command line."""


@pytest.mark.parametrize(
    ("write", "call", "command", "python", "option"), CASES.values(), ids=CASES.keys()
)
def test_a_remedy_is_in_the_words_of_the_interface(
    tmp_path: Path, write: Any, call: Any, command: Any, python: str, option: str
):
    file = write(tmp_path / "bench.csv")
    with pytest.raises(am.AirmuscleError) as caught:
        call(file)
    assert python in str(caught.value)
    assert option not in str(caught.value)
    out = () if command[0] == "inspect" else ("--out", tmp_path / "out")
    result = airmuscle(command[0], file, *command[1:], *out)
    assert result.exit_code == 1, result.output
    assert option in in_one_line(result.stderr)
    assert python not in in_one_line(result.stderr)


def test_two_files_that_disagree_name_the_option_for_the_unit(tmp_path: Path):
    for name, unit in (("a.csv", "kPa"), ("b.csv", "bar")):
        rows = "".join(f"{100 + i},{i / 10},{200 + i}\n" for i in range(20))
        text_file(tmp_path / name, f"pressure [{unit}],contraction [%],force [N]\n{rows}")
    result = airmuscle(
        "fit", tmp_path / "a.csv", tmp_path / "b.csv", *SURFACE, 1, "--out", tmp_path / "out"
    )
    assert "To state the unit, use --unit 'pressure=...'." in in_one_line(result.stderr)


def test_options_that_are_given_as_the_message_says_are_taken(tmp_path: Path):
    file = text_file(tmp_path / "bench.csv", NO_HEADINGS)
    said = in_one_line(airmuscle("inspect", file).stderr)
    columns = re.findall(r'--column "(.*?)"', said)
    assert columns == ["1=pressure [kPa]", "2=force [N]"]
    given = [part for column in (*columns, "3=contraction [%]") for part in ("--column", column)]
    assert airmuscle("inspect", file, *given).exit_code == 0


def test_notes_of_a_fit_name_options_in_text_and_json_and_arguments_in_python(tmp_path: Path):
    file = points(tmp_path / "bench.csv")
    assert any("use censoring=UNCENSORED." in note for note in fit(law(2), read(file)).notes)
    outputs = [
        airmuscle("fit", file, *SURFACE, 2, *more, "--out", tmp_path / "out").stdout
        for more in ((), ("--json",))
    ]
    assert all(
        "To treat them as measured values, use --uncensored." in in_one_line(text)
        for text in outputs
    )
    said = airmuscle("fit", file, *SURFACE, 2, "--uncensored", "--out", tmp_path / "out").stdout
    assert (
        "To treat them as censored, if the muscle was slack there, omit --uncensored."
        in in_one_line(said)
    )


def test_a_law_without_default_censoring_is_not_told_to_omit_an_option_that_was_not_given(
    tmp_path: Path,
):
    law_of_contraction = am.load("borzikova-exponential").characteristic
    notes = fit(law_of_contraction, _hung(law_of_contraction)).notes
    assert any(
        note.endswith("rows at zero force or below are treated as measured values.")
        for note in notes
    )


def _hung(law_of_contraction: Any) -> Recording:
    pressure, force = (
        x.ravel() for x in np.meshgrid(np.linspace(1e5, 5e5, 8), np.linspace(0.0, 200.0, 8))
    )
    inner = np.clip(pressure, 0.0, 3.5e5), np.clip(force, 45.0, 260.0)  # the range of the surface
    contraction = law_of_contraction.contraction(*inner)
    return Recording({"pressure": pressure, "force": force, "contraction": contraction}, "bench")


@pytest.mark.slow
def test_laws_that_are_left_out_of_a_ranking_name_options(tmp_path: Path):
    runs = [points(tmp_path / f"{i}.csv", 18 + 6 * i) for i in range(3)]
    reasons = [each.reason for each in compare(read(runs), leave_out=RunSplit()).excluded]
    assert any("use degree=" in reason for reason in reasons)
    command = ("--compare", "--leave-out", "run", "--json", "--out", tmp_path / "out")
    excluded = json.loads(airmuscle("fit", *runs, *command).stdout)["comparison"]["excluded"]
    assert [row["law"] for row in excluded if "degree=" in row["reason"]] == []
    assert any("--degree" in row["reason"] for row in excluded)


def test_rigs_with_different_sensors_name_the_option_for_equal_weights():
    note = HintedText("weighted.", Hint("To weight all rows equally", "sigma", 1.0))
    assert note == "weighted. To weight all rows equally, use sigma=1.0."
    assert in_options(note, "fit") == "weighted. To weight all rows equally, use --equal-weights."


RECORD = """
[observed]
pressure = "500 Pa"
[fit]
free = ["circuit.fill.conductance"]
[plant]
[plant.muscle]
library = "dmsp-20-300"
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "5 bar" }
fill = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
discharge = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
[plant.mechanism]
model = "Isometric"
contraction = 0.1
[input]
fill = [["0.1 s", 1]]
[[record]]
file = "run.csv"
"""


@pytest.mark.parametrize(
    ("content", "remedy"),
    [
        ("time [s],pressure\n0,1\n1,2\n", "To state the unit, write it in the heading"),
        (
            "0;1\n1;2\n",
            (
                'write columns = { 1 = "pressure [kPa]", 2 = "force [N]" } in the record\'s mapping'
                " file."
            ),
        ),
        (
            "time [s];pressure [Pa]\n0;1,234\n1;0.5\n",
            'write decimal = "," in the record\'s mapping file.',
        ),
    ],
)
def test_a_record_of_a_study_names_keys_of_its_files(tmp_path: Path, content: str, remedy: str):
    text_file(tmp_path / "run.csv", content)
    result = airmuscle(
        "fit-dynamic", text_file(tmp_path / "study.toml", RECORD), "--out", tmp_path / "out"
    )
    assert result.exit_code == 1, result.output
    assert "[record 1]" in result.stderr
    assert remedy in in_one_line(result.stderr), result.stderr
