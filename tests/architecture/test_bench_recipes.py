"""A reader, an option, a diagnosis, a fit and a command are added by the steps of AGENTS.md, each in
one place, and hold everywhere.

They are added to a copy of the package, with which one process uses them.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from recipe_models import run

ROOT = Path(__file__).resolve().parents[2]
BENCH = Path("src/airmuscle/bench")
OUTLETS = Path("src/airmuscle/outlets")
READER = '''"""Reader of tables whose cells are divided by bars (.bars)."""

from pathlib import Path

import numpy as np

from ..tables import RawTable, Selection


def read_bars_tables(path: Path, selection: Selection) -> tuple[RawTable, ...]:
    """The table of a file. Raises FileError."""
    lines = [line.split("|") for line in path.read_text(encoding="utf-8").splitlines()]
    columns = np.array(lines[1:], dtype=float).T
    rows = np.arange(2, len(lines) + 1)
    return (RawTable(path.name, tuple(lines[0]), None, tuple(columns), rows),)
'''
RULE = """

def _few_rows(case: FitCase) -> Iterator[str]:
    if case.fit.rows_used < 30:
        yield f"The fit has {case.fit.rows_used} rows. Measure more."


FIT_RULES += (DiagnosisRule("a fit to few rows", Subject.FIT, _few_rows, "measure more rows"),)
"""
COMMAND = '''"""`airmuscle count`: the number of rows of files."""

from ...report.chapter import Chapter, NamedValue
from ..requests import ReadingRequest
from .delivery import deliver
from .measurements import Files, read_recordings
from .options import Json
from .requested import with_requests


@with_requests
def count(files: Files, reading: ReadingRequest, json: Json = False) -> None:
    """Count the rows of files."""
    rows = sum(map(len, read_recordings(files, reading)))
    chapter = Chapter("count", "Rows", "All rows.", values=(NamedValue("rows", rows),))
    deliver("count", [chapter], json=json)
'''
USED = '''
import dataclasses
import sys
import warnings
from pathlib import Path

import numpy as np

from airmuscle.bench import ColumnMapping, Huber, LeastSquares, diagnose, fit, read
from airmuscle.bench.estimation import (
    FreeParameter,
    MeasuredProblem,
    Runs,
    SolvedProblem,
    solve_least_squares,
    watched_searches,
)
from airmuscle.outlets.requests import FitRequest, build
from airmuscle.outlets.requests.declaration import form_fields
from airmuscle.physics import ContractileSurface

folder = Path(sys.argv[1])
pressure, contraction = (g.ravel() for g in np.meshgrid(np.linspace(100, 600, 5), np.linspace(0, 20, 5)))
noise = np.random.default_rng(1).standard_normal(25)
force = 3.0 * pressure * (1.0 - contraction / 25.0) + noise
rows = ["pressure [kPa]|contraction [%]|force [N]"]
rows += ["|".join(map(str, row)) for row in zip(pressure.tolist(), contraction.tolist(), force.tolist())]
(folder / "run.bars").write_text("\\n".join(rows))

# A reader: the file is read like any other
(recording,) = read(folder / "run.bars")
assert len(recording) == 25
assert abs(recording["pressure"][0] - 1e5) < 1e-6

# A diagnosis: every fit states it
fitted = fit(ContractileSurface.blank(2), recording)
assert "The fit has 25 rows. Measure more." in fitted.notes
assert "a fit to few rows" in [diagnosis.rule for diagnosis in diagnose(fitted)]

# An option: request, form and unit
request = build(FitRequest, {"characteristic": "ContractileSurface", "above_force": "2 kN"}, str)
assert request.above_force == 2e3
assert "above_force" in [field["name"] for field in form_fields(FitRequest)]


# A fit: parameters and the fitted quantity alone
@dataclasses.dataclass(frozen=True, eq=False)
class Decay(MeasuredProblem):
    """y = a exp(-k t)."""

    time: np.ndarray
    target: np.ndarray

    name = "Decay"
    origin = "made"
    quantity = "level"
    parameters = (
        FreeParameter("a", "a", 1.0, (0.0, 10.0), "1", "amplitude", True),
        FreeParameter("k", "k", 0.3, (0.0, 9.0), "1/s", "rate"),
    )

    @property
    def runs(self):
        run = np.arange(self.target.size) // 20
        return Runs(run, np.zeros(run.size, dtype=int), True)

    def predict(self, values):
        return values[0] * np.exp(-values[1] * self.time)


time = np.linspace(0.0, 3.0, 200)
random = np.random.default_rng(2)
level = 2.0 * np.exp(-1.5 * time) + 0.02 * random.standard_normal(200)
problem = Decay(time, level)
steps = []
with watched_searches(lambda name, fraction: steps.append(name)):
    solution = solve_least_squares(problem, LeastSquares())
assert "Decay" in steps
solved = SolvedProblem(problem, solution.values)
for estimate, truth in zip(solved.estimates, (2.0, 1.5)):
    assert abs(estimate.value - truth) < 4.0 * estimate.stderr < 0.2
low, high = solved.profile("k")
assert low < 1.5 < high
drawn = solved.bootstrap(40)
assert drawn.shape == (40, 2)
assert np.nanstd(drawn[:, 1]) < 0.2
assert not solved.identifiability.undetermined
spoilt = dataclasses.replace(problem, target=np.where(np.arange(200) % 25 == 7, 5.0, level))
robust = solve_least_squares(spoilt, Huber(0.06)).values
assert np.abs(robust - [2.0, 1.5]).max() < 0.1 < np.abs(solve_least_squares(spoilt, LeastSquares()).values - [2.0, 1.5]).max()
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    with watched_searches(budget=1e-9):
        solve_least_squares(problem, LeastSquares())
assert any("Give a longer budget" in str(warning.message) for warning in caught)

# A command
sys.argv = ["airmuscle", "count", str(folder / "run.bars"), "--json"]
from airmuscle.__main__ import main
main()
'''


def replace(root: Path, place: Path, before: str, after: str) -> None:
    path = root / place
    text = path.read_text(encoding="utf-8")
    assert before in text, f"{place} has no {before!r}"
    path.write_text(text.replace(before, after, 1), encoding="utf-8")


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package with what the recipes of AGENTS.md add."""
    root = tmp_path_factory.mktemp("extended")
    shutil.copytree(
        ROOT / "src" / "airmuscle",
        root / "src" / "airmuscle",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    table = BENCH / "readers" / "formats" / "format_table.py"
    (root / table).with_name("raw_bars.py").write_text(READER, encoding="utf-8")
    entry = '    Format("bars", (".bars",), tables="raw_bars.read_bars_tables"),\n'
    replace(root, table, '    Format("NPZ"', f'{entry}    Format("NPZ"')
    rules = root / BENCH / "statics" / "fit_rules.py"
    rules.write_text(rules.read_text(encoding="utf-8") + RULE, encoding="utf-8")
    option = (
        "    above_force: float | None = optional(\n"
        '        "Fit rows above this force alone.", unit="N", label="Rows above"\n'
        "    )\n"
    )
    field = "    bootstrap: int | None = optional(\n"
    replace(root, OUTLETS / "requests" / "fit.py", field, option + field)
    (root / OUTLETS / "cli" / "count.py").write_text(COMMAND, encoding="utf-8")
    row = '    CommandRow("count", "Count the rows of files."),\n'
    commands = OUTLETS / "cli" / "commands.py"
    replace(root, commands, "COMMANDS = (\n", f"COMMANDS = (\n{row}")
    return root


def test_what_the_recipes_add_holds_everywhere(extended: Path, tmp_path: Path):
    (extended / "use.py").write_text(USED, encoding="utf-8")
    done = run(extended, "use.py", str(tmp_path))
    assert done.returncode == 0, done.stderr[-3000:]
    assert '"rows": 25' in done.stdout or '"value": 25' in done.stdout, done.stdout


@pytest.mark.parametrize(
    "place",
    [
        "`bench/readers/formats/`",
        "`FORMATS`",
        "`tests/measurement_files.py`",
        "`option(...)`",
        "`DiagnosisRule`",
        "`tests/identify/test_rules.py`",
        "`LeastSquaresProblem`",
        "`ProblemSearch`",
        "`COMMANDS`",
    ],
)
def test_each_place_is_in_the_rules(place: str):
    text = (ROOT / "AGENTS.md").read_text(encoding="utf-8").split("## Adding to the bench")[1]
    assert place in text
