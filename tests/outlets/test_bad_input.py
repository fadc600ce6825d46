"""Bad input ends in one clear line: where, what, what is allowed, what to do; exit code 1, nothing
half written.

Each case goes through the command line as a user would, and its message is read.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import airmuscle
from widths import SAME_LAW, widened

from airmuscle import advance, load, load_data, read_csv, simulate
from airmuscle.core import ABSOLUTE, atomic_folder, check_writable, model, parameter
from airmuscle.engine import SampledSignal, Schedule
from airmuscle.engine.compile.cache.kernel import BoundKernel, fixed_step
from airmuscle.engine.run import integrators
from airmuscle.errors import FileError, ParameterError, SolveError, UnitError
from airmuscle.files import list_laws
from airmuscle.files.library import read_toml
from airmuscle.physics import FillDischarge, HangingMass, Plant, Supply, Valve, find_equilibrium
from airmuscle.units import conversion, quantity

MUSCLE = "dmsp-20-300"
HEAD = "pressure [bar],length [mm],force [N]"
SURFACE = ("--characteristic", "ContractileSurface", "--degree", "2", "--resting-length", "300 mm")


def refused(folder: Path, *arguments: object) -> str:
    """The one line on stderr of a command that fails in a folder where nothing may appear."""
    before = sorted(folder.rglob("*"))
    result = airmuscle(*arguments)
    assert result.exit_code == 1, result.output
    assert isinstance(result.exception, SystemExit), "no traceback"
    lines = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
    assert len(lines) == 1, lines
    assert lines[0].startswith("error: ")
    assert sorted(folder.rglob("*")) == before, "nothing half written"
    return lines[0].removeprefix("error: ")


# Bench files


def rows(*columns: int, count: int = 35) -> list[list[float]]:
    """Pressures of 1.5 to 5.5 bar, lengths from 300 mm down and the force of a plane over them."""
    found = [[1.5 + i % 5, 300.5 - 10 * (i // 5)] for i in range(count)]
    table = [[p, length, 100 * p + 3 * length - 850] for p, length in found]
    return [[row[c] for c in columns or (0, 1, 2)] for row in table]


def bench(head: str = HEAD, table: list[list[float]] | None = None, **replaced: object) -> str:
    """A bench file; `row_7="a,b,c"` replaces the seventh row."""
    lines = [",".join(map(str, row)) for row in (rows() if table is None else table)]
    for key, line in replaced.items():
        lines[int(key.removeprefix("row_")) - 1] = str(line)
    return "\n".join([head, *lines]) + "\n"


CSV = {
    "without units": (
        bench("pressure,length,force"),
        (
            r"no unit is stated for 3 columns \(pressure, length, force\). .* use --unit"
            r" 'pressure=...' --unit 'length=...' --unit 'force=...'"
        ),
    ),
    "decimal comma": (
        bench(row_1="1,5,300,5,201,5"),
        (
            r"line 2: the line must have 3 cells .* it has 6. .* decimal comma, separate the"
            r" columns by ';'"
        ),
    ),
    "text": (
        bench(row_7="n/a,290,100"),
        r"line 8: pressure 'n/a' is not a number. Correct the cell or delete",
    ),
    "NaN": (
        bench(row_7="nan,290,100"),
        r"line 8: pressure is nan; it must be finite. Correct the cell or delete .* use --missing",
    ),
    "infinity": (bench(row_7="1e400,290,100"), r"line 8: pressure is inf; it must be finite"),
    "empty cell": (bench(row_7=",290,100"), r"line 8: pressure has an empty cell"),
    "no rows": (HEAD, r"no rows of numbers below the headings \(pressure \[bar\], "),
    "nothing": ("", r"the file is empty"),
    "ragged": (bench(row_35="1,2"), r"line 36: the line must have 3 cells \(.*\); it has 2"),
    "time backwards": (
        bench(f"time [s],{HEAD}", [[9 - i, *row] for i, row in enumerate(rows())]),
        (
            r"line 3: time 8 s is less than the time of the previous row \(9 s\). Time must"
            r" increase: sort the rows"
        ),
    ),
    "unknown column": (
        bench(HEAD.replace("press", "pres")),
        r"no column 'pressure'; .* Did you mean 'presure \[bar",
    ),
    "unknown unit": (
        bench(HEAD.replace("bar", "brr")),
        r"'pressure \[brr\]': 'brr' is not a known unit.*mean 'bar'\?",
    ),
    "wrong kind": (
        bench(HEAD.replace("bar", "mm")),
        r"'pressure \[mm\]': unit 'mm' cannot be converted to 'Pa'",
    ),
    "vacuum": (
        bench(row_3="-3,290,100"),
        r"line 4: a gauge pressure of -300 kPa is not above absolute vacuum",
    ),
    "metres": (
        bench(HEAD.replace("mm", "m")),
        (
            r"line 2: with a resting length of 0.3 m, the contraction -1001 is outside the"
            r" plausible range"
        ),
    ),
    "per cent": (
        bench(
            "pressure [bar],contraction,force [N]", [[p, (301 - x) / 3, f] for p, x, f in rows()]
        ),
        (
            r"line 7: contraction 3.5 is outside the plausible range -0.5 to 1. For values in"
            r" percent, rename .* 'contraction \[%\]'"
        ),
    ),
    "no force": (
        bench("pressure [bar],length [mm]", rows(0, 1)),
        r"no column 'force'; the columns are pressure, length",
    ),
    "twice": (
        bench(f"force [N],{HEAD}", rows(1, 0, 1, 2)),
        r"columns 'force \[N\]' and 'force \[N\]' \(numbers 1 and \d\) both contain the force",
    ),
    "few points": (bench(table=rows()[:3] + rows()[5:7]), r"6 free parameters, but only 5 rows"),
    "one pressure": (
        bench(table=[[3, *r] for r in rows(1, 2)]),
        r"pressure is 300000 Pa in every row.*several levels",
    ),
    "two pressures": (
        bench(table=[[1 if p < 3 else 4, *rest] for p, *rest in rows()]),
        (
            r"cannot separate a\(1\), a\(q\^2\) .*\(rank 5 of 6 parameters\).*2 of pressure, 7 of"
            r" contraction.*Measure at more.*--degree 1"
        ),
    ),
    "slack": (
        bench(table=[[p, length, 0] for p, length, _ in rows()]),
        r"the force is less than 0\.001 N in every row: the muscle is slack",
    ),
}


@pytest.mark.parametrize(("text", "message"), CSV.values(), ids=CSV.keys())
def test_a_bench_file_that_cannot_be_fitted(tmp_path: Path, text: str, message: str):
    file = tmp_path / "bench.csv"
    file.write_text(text, encoding="utf-8")
    said = refused(tmp_path, "fit", file, *SURFACE, "--out", tmp_path / "fit")
    assert re.search(rf"bench\.csv.*{message}", said), said


@pytest.mark.parametrize(
    "content",
    [
        bench().encode("utf-8-sig"),
        f"# Prüfstand\n{bench()}".encode("latin-1"),
        bench().replace(",", ";").replace(".", ",").encode(),
        bench().replace("\n", "\r\n").encode(),
    ],
    ids=["byte order mark", "Latin-1", "decimal comma between semicolons", "lines of Windows"],
)
def test_what_other_programs_write_is_read(tmp_path: Path, content: bytes):
    (tmp_path / "bench.csv").write_bytes(content)
    arguments = [
        "fit",
        str(tmp_path / "bench.csv"),
        *SURFACE,
        "--out",
        str(tmp_path / "fit"),
        "--json",
    ]
    result = airmuscle(*arguments)
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["fit"]["rms_error"] < 1e-6


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--resting-length", "-300 mm"), "resting_length is -0.3 m; it must be positive"),
        (("--resting-length", "300 N"), "resting_length: unit 'N' cannot be converted to 'm'"),
        (("--resting-length", "300"), "resting_length: '300' has no unit"),
        (
            ("--unit", "presure=bar"),
            "a unit is given for 'presure', but .* Did you mean 'pressure'",
        ),
        (
            ("--fix", "coefficient"),
            "no parameter 'coefficient' to be fixed; .* Did you mean 'coefficients'",
        ),
        (("--robust", "-1 N"), "is -1.0; it must be positive"),
    ],
)
def test_a_bad_option_of_fit(tmp_path: Path, option: tuple[str, str], message: str):
    (tmp_path / "bench.csv").write_text(bench(), encoding="utf-8")
    said = refused(
        tmp_path, "fit", tmp_path / "bench.csv", *SURFACE, *option, "--out", tmp_path / "fit"
    )
    assert re.search(message, said), said


def test_a_data_set_is_known_by_a_unique_beginning_and_brings_its_units(tmp_path: Path):
    surface = ("--characteristic", "ContractileSurface", "--degree", "2")
    result = airmuscle("fit", "dmsp-20", *surface, "--out", tmp_path / "fit", "--json")
    assert json.loads(result.stdout)["fit"]["rows_used"] == len(load_data(MUSCLE))
    said = refused(
        tmp_path, "fit", MUSCLE, *surface, "--unit", "pressure=psi", "--out", tmp_path / "other"
    )
    assert (
        said
        == f"{MUSCLE}: a data set of the library contains its units and constants; omit --unit."
    )
    said = refused(tmp_path, "fit", "dmps-20-300", *surface, "--out", tmp_path / "other")
    assert re.fullmatch(rf"no data set 'dmps-20-300'; there are .* Did you mean '{MUSCLE}'\?", said)


# Requests without an answer


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            ("--pressure=3 bar", "--contraction=90 %"),
            r"contraction: 90 % is outside the range of MartensBoblan2017, -4.9\d+ to 40 %",
        ),
        (
            ("--pressure=3 bar", "--contraction=-50 %"),
            r"contraction: -50 % is outside the range of ",
        ),
        (
            ("--pressure=3 bar", "--contraction=12"),
            r"contraction: 1200 % is outside .* For a percentage, write '12 %'",
        ),
        (
            ("--pressure=3 bar", "--contraction=12 mm"),
            "--contraction: unit 'mm' cannot be converted to a ratio",
        ),
        (
            ("--pressure=3 bar", "--contraction=12 deg"),
            "--contraction: unit 'deg' cannot be converted to a ratio",
        ),
        (
            ("--pressure=3,5 bar", "--force=1 N"),
            "'3,5 bar' contains a comma; write a decimal point, '3.5 bar'",
        ),
        (
            ("--pressure=3 Bar", "--force=1 N"),
            r"--pressure: 'Bar' is not a known unit.* Did you mean 'bar'\?",
        ),
        (("--pressure=1e400 bar", "--force=1 N"), "--pressure: '1e400 bar' is too large"),
        (
            ("--pressure=nan bar", "--force=1 N"),
            "--pressure: 'nan bar' is not a number with a unit; write it like",
        ),
        (
            ("--pressure=0 bara", "--force=1 N"),
            "a gauge pressure of -101.325 kPa is not above absolute vacuum",
        ),
        (
            ("--pressure=3 bar", "--force=-10 N"),
            (
                "no contraction in the range .* is in equilibrium with -10 N at 300 kPa. Available"
                " force: 0 to"
            ),
        ),
        (("--pressure=9**9**9**9", "--force=1 N"), "--pressure: .* is not a known unit"),
    ],
)
def test_a_request_that_no_muscle_can_meet(tmp_path: Path, given: tuple[str, ...], message: str):
    said = refused(tmp_path, "evaluate", MUSCLE, *given, "--out", tmp_path / "chart")
    assert re.search(message, said), said


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
@pytest.mark.parametrize("name", widened(list_laws(), lambda name: name not in SAME_LAW))
def test_every_entry_answers_or_refuses_in_one_line(name: str):
    """Loads, pressures and contractions far beyond any muscle: a number that JSON can hold, or one
    line.
    """
    beyond = (
        ("--pressure=3 bar", "--force=1e6 N"),
        ("--pressure=0 bar", "--force=100 N"),
        ("--force=1e9 N", "--contraction=0.1"),
    )
    for given in (
        *beyond,
        ("--pressure=3 bar", "--contraction=0.95"),
        ("--pressure=9 MPa", "--force=100 N"),
    ):
        result = airmuscle("evaluate", name, *given, "--json")
        assert isinstance(result.exception, SystemExit | None), given
        others = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
        assert len(others) == result.exit_code, others
        if result.exit_code == 0:
            solved = json.loads(result.stdout)["evaluation"]
            assert -0.5 <= solved["contraction"] < 1.0
            assert all(
                isinstance(solved[quantity], float)
                for quantity in ("pressure", "contraction", "force")
            )


@pytest.mark.parametrize("name", ["chou-hannaford", "tondu-lopez"])
def test_without_pressure_a_closed_form_bears_no_load(name: str):
    law = load(name).characteristic
    for pressure in (0.0, np.array([0.0, 3e5])):
        with pytest.raises(
            SolveError, match=r"in equilibrium with 100 N at 0 kPa\. Available force: 0 to 0 N"
        ):
            law.contraction(pressure, 100.0)


def test_an_answer_that_no_muscle_can_be_is_refused(tmp_path: Path):
    said = refused(
        tmp_path, "evaluate", "borzikova-direct-repaired", "--pressure=9 MPa", "--force=100 N"
    )
    assert "9000 kPa is outside the validity range of the surface, 0 to 350 kPa" in said


# Units


@pytest.mark.parametrize(
    "unit", ["9**9**9**9", "m**99999999", "m^9^9^9", "10**99999999 m", "(9)**(9)**(9)"]
)
def test_a_unit_that_would_never_be_worked_out_is_refused_at_once(unit: str):
    start = time.perf_counter()
    with pytest.raises(UnitError, match="is not a known unit"):
        conversion(unit, "Pa")
    assert time.perf_counter() - start < 2.0


def test_powers_that_units_have_are_taken():
    assert quantity("2 kg m^2 s^-2", "J") == quantity("2 kg*m**2/s**2", "J") == 2.0


def test_the_pressure_of_the_surroundings_takes_no_gauge_unit():
    assert (
        quantity("1 bara", ABSOLUTE)
        == quantity("100 kPa(a)", ABSOLUTE)
        == quantity("1 bar", ABSOLUTE)
        == 1e5
    )
    with pytest.raises(
        UnitError,
        match=r"here: unit 'barg' is gauge, but this pressure is absolute; write kPa\(a\)",
    ):
        quantity("1 barg", ABSOLUTE, where="here")


def test_a_unit_is_not_suggested_in_its_own_place():
    with pytest.raises(UnitError, match=r"write kPa\(a\) or bara\.$"):
        quantity("1 barg", ABSOLUTE, where="here")


def test_a_whole_number_beyond_all_floats():
    with pytest.raises(UnitError, match="here: the number is too large"):
        quantity(10**400, "Pa", where="here")


# Python


@model
class Tube:
    """A model for these tests."""

    radius: float = parameter("m", "r", "radius", bounds=(0.001, 0.1))
    share: float = parameter("1", "s", "share of the length", bounds=(0.0, 0.9), default=0.5)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radius": "1"}, r"Tube.radius \(r, radius\): '1' has no unit; write it like"),
        ({"radius": np.nan}, r"is nan; it must be finite"),
        (
            {"radius": 20.0},
            r"is 20 m; allowed range: 0.001 to 0.1 m. Values are in SI units; check the unit",
        ),
        ({"radius": np.array([0.01])}, r"is array\(\[0.01\]\); it must be one number"),
        (
            {"radius": 0.01, "share": 30},
            r"is 30; allowed range: 0 to 0.9. Is it in per cent\? As a ratio it is 0.3",
        ),
        ({"radius": 0.01, "share": -1}, r"is -1; allowed range: 0 to 0.9.$"),
        ({"radius": 0.01, "share": True}, r"is True; it must be a number.$"),
    ],
)
def test_a_parameter_that_cannot_be(given: dict[str, object], message: str):
    with pytest.raises((ParameterError, UnitError), match=message):
        Tube(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", [Schedule, SampledSignal])
@pytest.mark.parametrize("given", [1, (1, 2), ((1, 2, 3),), (("5 s", 1),)])
def test_a_command_that_is_no_pairs(kind: type, given: object):
    with pytest.raises(
        ParameterError, match=r"of 'fill' is .*; write pairs of time \[s\] and value, \(\(5, 1\)"
    ):
        kind({"fill": given})


@pytest.mark.parametrize("kind", [Schedule, SampledSignal])
@pytest.mark.parametrize("given", [None, ((5, 1), (15, 0))])
def test_a_command_that_names_no_inputs(kind: type, given: object):
    with pytest.raises(
        ParameterError, match=r"a (schedule|sampled signal) is .*; name the inputs: {'fill': "
    ):
        kind(given)


@pytest.fixture
def plant() -> Plant:
    valve = Valve(3e-9, 0.3)
    return Plant(load(MUSCLE).muscle, FillDischarge(Supply(5e5), valve, valve), HangingMass(5.0))


def test_a_run_that_cannot_be(plant: Plant):
    wrong = (
        {"duration": -1.0},
        {"duration": np.inf},
        {"start_time": np.nan},
        {"start_time": 1e300},
        {"output_times": np.inf},
        {"output_times": [0.1, np.nan]},
    )
    for given in wrong:
        (name,) = given
        with pytest.raises(ParameterError, match=f"simulate: .*{name}"):
            simulate(plant, Schedule({}), **{"duration": 1.0, **given})
    for opening in (7.0, -0.5):
        with pytest.raises(
            ParameterError,
            match=(
                rf"the input 'fill' is {opening:g} before 1 s; allowed range: 0 to 1 \(opening, 0"
                r" closed"
            ),
        ):
            simulate(plant, Schedule({"fill": ((0, opening),)}), duration=1.0)
        with pytest.raises(ParameterError, match=rf"the input 'fill' is {opening:g}"):
            advance(plant, find_equilibrium(plant, pressure=0.0), {"fill": opening}, 0.1)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, np.inf])
def test_a_step_of_no_length(plant: Plant, dt: float):
    with pytest.raises(
        ParameterError, match=r"advance: dt is .* s; it must be positive and finite"
    ):
        advance(plant, find_equilibrium(plant, pressure=0.0), {}, dt)


# Muscle files


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\x00", r"is not valid TOML: Invalid statement \(at line 1, column 1\)"),
        (b"\xff\xfe", r"is not UTF-8 text \(byte 0\). Save it as UTF-8"),
        (b"title = 'a'\ntitle = 'b'\n", r"is not valid TOML: Cannot overwrite a value \(at line 2"),
        (b"x = " + b"[" * 5000 + b"]" * 5000, r"cannot be read \(maximum recursion depth"),
        (b"x = 1" + b"0" * 5000, r"cannot be read \(Exceeds the limit"),
    ],
)
def test_a_file_that_is_no_toml(tmp_path: Path, content: bytes, message: str):
    (tmp_path / "muscle.toml").write_bytes(content)
    said = refused(tmp_path, "show", tmp_path / "muscle.toml")
    assert re.search(rf"muscle\.toml: {message}", said), said


@pytest.mark.parametrize("name", ["a\0.toml", f"{'a' * 5000}.toml"])
def test_a_name_that_no_file_can_have(name: str):
    with pytest.raises(FileError, match="cannot be read"):
        read_toml(Path(name))


BOX = "min_pressure = 0\nmax_pressure = 6e5\nmin_contraction = 0\nmax_contraction = 0.25\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "validity_range = 3",
            (
                r"\[validity_range\] is 3; it must be a table. Write its values in it:"
                r" min_pressure, max_pressure, min_contraction, max_contraction\.$"
            ),
        ),
        (
            f"[validity_range]\n{BOX.replace('0.25', '25')}",
            r"\[validity_range\]: ValidityRange.max_contraction .* is 25; allowed range: -0.5 to 1",
        ),
        (
            f"[validity_range]\n{BOX.replace('min_pressure = 0', 'min_pressure = -3e5', 1)}",
            r"\[validity_range\]: .* is -300000 Pa",
        ),
        (
            f'[validity_range]\nmodel = "Braid"\n{BOX}',
            r"\[validity_range\]: Braid is not allowed here; a ValidityRange is required",
        ),
        (
            (
                '[[check]]\nquantity = "volume"\ncontraction = nan\nequals = 1\ntolerance ='
                ' 1\nsource = "s"'
            ),
            r"contraction is nan",
        ),
        (
            (
                '[[check]]\nquantity = "volume"\ncontraction = 0\nequals = 1\ntolerance ='
                ' -1\nsource = "s"'
            ),
            r"tolerance is -1",
        ),
        (
            '[[reference]]\nkey = "k"\nauthors = "a"\ntitle = "t"\nwhere = "w"\ndoi = 3',
            r"\[reference 1\]: doi is 3",
        ),
    ],
)
def test_a_muscle_file_with_a_bad_table(tmp_path: Path, text: str, message: str):
    law = (
        '[characteristic]\nmodel = "ChouHannaford1996"\n[characteristic.geometry]\nmodel ='
        ' "Braid"\n'
    )
    head = (
        f'title = "t"\nprovenance = "chosen"\n{text if text.startswith("validity_range") else ""}\n'
    )
    braid = "radius = 0.01\nbraid_angle = 0.4\nresting_length = 0.3\n"
    file = tmp_path / "muscle.toml"
    file.write_text(
        head + law + braid + ("" if text.startswith("validity_range") else text), encoding="utf-8"
    )
    said = refused(tmp_path, "show", file)
    assert re.search(rf"muscle\.toml.*{message}", said), said


# Folders


@pytest.mark.parametrize("name", ["taken", "taken/below", "a" * 300])
def test_a_folder_that_cannot_be_made(tmp_path: Path, name: str):
    (tmp_path / "taken").write_text("a file", encoding="utf-8")
    with pytest.raises(
        FileError, match=r"cannot be written to: .*Specify a folder with write permission"
    ):
        check_writable(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def write_a_run(folder: Path) -> None:
    with atomic_folder(folder) as place:
        for name in ("data/rows.csv", "figures/run.png", "report.html"):
            (place / name).parent.mkdir(exist_ok=True)
            (place / name).write_text("new", encoding="utf-8")


@pytest.mark.parametrize(("blocked", "is_folder"), [("report.html", True), ("figures", False)])
def test_a_name_that_is_taken_leaves_the_folder_as_it_was(
    tmp_path: Path, blocked: str, is_folder: bool
):
    target = tmp_path / "run"
    target.mkdir()
    (
        (target / blocked).mkdir()
        if is_folder
        else (target / blocked).write_text("a file", encoding="utf-8")
    )
    kind = "folder" if is_folder else "file"
    with pytest.raises(FileError, match=rf"a {kind} of this name exists \(.*{blocked}\)"):
        write_a_run(target)
    assert [path.name for path in target.rglob("*")] == [blocked]


@pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="only Linux has a device that is always full"
)
@pytest.mark.parametrize("option", widened([((),), (("--json",),)], lambda option: not option))
def test_a_full_disk_is_one_line(option: tuple[str, ...]):
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "airmuscle", "list", *option]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert done.returncode == 1
    assert done.stderr == "error: output: No space left on device.\n"


COMPILING = "compiling "
"""Beginning of the lines on kernels that are not yet stored on the machine."""


class Interrupted:
    """A kernel that the user stops during its third packet of steps."""

    def __init__(self, kernel: BoundKernel) -> None:
        self.kernel = kernel
        self.packets = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.kernel, name)

    def __call__(self) -> int:
        self.packets += 1
        if self.packets > 2:
            raise KeyboardInterrupt
        return self.kernel()


def test_an_interrupted_simulation_keeps_what_it_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "run.toml").write_text(
        f'[plant]\nmuscle = "{MUSCLE}"\ncircuit = "ClosedChamber"\n'
        'mechanism = { model = "HangingMass", mass = "5 kg" }\n'
        '[run]\nduration = "1 s"\nintegrator = { model = "RungeKutta4", step = "1 ms" }\n',
        encoding="utf-8",
    )
    bind = fixed_step.bind
    monkeypatch.setattr(fixed_step, "bind", lambda **arguments: Interrupted(bind(**arguments)))
    monkeypatch.setattr(integrators, "INTERRUPT_CHECK_STEPS", 100)
    result = airmuscle("simulate", tmp_path / "run.toml", "--out", tmp_path / "run")
    assert result.exit_code == 130
    lines = [line for line in result.stderr.splitlines() if not line.startswith(COMPILING)]
    assert lines == [f"partial results were written to {tmp_path / 'run'}", "interrupted"]
    kept = read_csv(tmp_path / "run" / "recording.csv")
    assert kept["time"][-1] == pytest.approx(0.2, abs=0.0011)


def test_what_a_killed_process_has_left_is_removed_by_the_next_one(tmp_path: Path):
    code = (
        "import os, signal, sys; from airmuscle.core.atomic_output import atomic_folder\nwith"
        " atomic_folder(sys.argv[1]) as folder:\n    (folder / 'a.csv').touch();"
        " os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    assert len(list(tmp_path.glob(".unfinished-*"))) == 1
    with atomic_folder(tmp_path) as mine, atomic_folder(tmp_path) as other:
        assert sorted(tmp_path.iterdir()) == sorted([mine, other]), (
            "the folder of a running process is kept"
        )
    assert not list(tmp_path.iterdir())
