"""A model is added by the steps of AGENTS.md: with all steps it passes the contract tests, without
one a test names it.

The models are added to a copy of the project; the tests of the copy run there.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from recipe_models import RECIPES, add, run, write_nomenclature

ROOT = Path(__file__).resolve().parents[2]
CONTRACTS = (
    "tests/architecture/test_models.py",
    "tests/architecture/test_names.py",
    "tests/dynamics/test_continuity.py",
    "tests/laws/test_directions.py",
    "tests/outlets/test_component_files.py",
    "tests/papers/test_library_checks.py",
)
CHECK = """
import airmuscle as am
from airmuscle.files.library.build import build
from airmuscle.files.library.files import Location
from pathlib import Path
from plants import OTHER, of, fed

here = Location("test", "", Path())
law = build({"model": "DummyLaw", "area": "10 cm^2"}, here)
valve = build({"model": "DummyValve", "slope": "1e-8 kg/(s Pa)"}, here)
friction = build({"model": "DummyFriction", "bristle_stiffness": "50 N/mm", "slip": "0.4 mm"}, here)
relay = build({"model": "DummyController", "measured": "position", "commanded": "fill", "proportional_gain": 50.0}, here)
assert law.force(1e5, 0.15) == 50.0
assert valve.mass_flow(3e5, 1e5, 0.5, 293.0) == 1e-3
assert friction.force({"bristle": 1e-4}, 0.0) == 5.0
command = am.Schedule({"fill": ((0.0, 1.0),)})
loop = am.ControlLoop(relay, 0.01, am.Schedule({"position": ((0.0, 0.01),)}))
circuit = am.FillDischarge(am.Supply(5e5), valve, OTHER)
for plant, signal in ((of(law), command), (fed(circuit), command), (of(friction=friction), command), (of(), loop)):
    run = am.simulate(plant, signal, duration=0.1, initial_state=plant.state_at(pressure=2e5))
    assert run["time"][-1] == 0.1, plant
"""
"""Construction from tables, evaluation and 0.1 s of simulation of all four models."""
STEPS = [(kind, step) for kind, recipe in RECIPES.items() for step in recipe.steps]
MESSAGES = {
    "export": r"export {name} in airmuscle/{folder}/__init__\.pyi",
    "library": r"write a file in airmuscle/files/library that names {name}",
    "example": r"{name}: airmuscle\.{package}\.{module} is in no plant of tests/plants\.py",
    "exemption": (
        r"{name}: airmuscle\.{package}\.{module} is in no plant of tests/plants\.py, nor in"
        r" NOT_IN_A_PLANT"
    ),
    "nomenclature": r"run release/make_nomenclature\.py: {name} is missing",
}


def copy_of_the_project(folder: Path) -> Path:
    for part in ("src/airmuscle", "tests", "docs", "release", "benchmarks"):
        shutil.copytree(
            ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__", "images")
        )
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, folder)
    return folder


def named(kind: str, without: str = "") -> str:
    return f"Dummy{kind.title()}" + (f"Without{without.title()}" if without else "")


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy in which each model is added by all steps."""
    root = copy_of_the_project(tmp_path_factory.mktemp("complete"))
    for kind in RECIPES:
        add(root, kind, named(kind))
    write_nomenclature(root)
    return root


@pytest.fixture(scope="module")
def failures(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Output of the contract tests of a copy in which each model lacks one step."""
    root = copy_of_the_project(tmp_path_factory.mktemp("incomplete"))
    for kind, step in STEPS:
        if step != "file":
            add(root, kind, named(kind, step), without=step)
    write_nomenclature(root, omitted=tuple(named(kind, "nomenclature") for kind in RECIPES))
    wanted = ("-k", "test_models or test_names or looked_at")
    return run(
        root, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *CONTRACTS[:3], *wanted
    ).stdout


def test_the_contract_tests_find_a_complete_model_and_pass(complete: Path):
    wanted = ("-k", "test_models or test_names or looked_at or dummy")
    done = run(complete, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", *CONTRACTS, *wanted)
    assert done.returncode == 0, done.stdout[-3000:]
    assert int(re.search(r"(\d+) passed", done.stdout)[1]) >= 20


@pytest.mark.slow
def test_a_complete_model_is_built_evaluated_and_simulated(complete: Path):
    done = run(complete, "-c", "import sys; sys.path[:0] = ['tests', 'benchmarks']\n" + CHECK)
    assert done.returncode == 0, done.stderr[-2000:]


@pytest.mark.parametrize(("kind", "step"), [(kind, step) for kind, step in STEPS if step != "file"])
@pytest.mark.slow
def test_a_contract_test_names_a_missing_step(failures: str, kind: str, step: str):
    name = named(kind, step)
    pattern = MESSAGES[step].format(
        name=name, module=name.lower(), package=RECIPES[kind].package, folder=RECIPES[kind].folder
    )
    assert re.search(pattern, failures), failures[-3000:]


@pytest.mark.parametrize("kind", RECIPES)
def test_a_missing_file_is_named_by_the_import(complete: Path, kind: str):
    name = named(kind)
    package = RECIPES[kind].package
    file = complete / "src" / "airmuscle" / RECIPES[kind].folder / f"{name.lower()}.py"
    aside = file.rename(file.with_suffix(".aside"))
    done = run(complete, "-c", f"from airmuscle.{package} import {name}")
    aside.rename(file)
    assert done.stderr.endswith(f"No module named 'airmuscle.{package}.{name.lower()}'\n")


@pytest.mark.parametrize(("kind", "step"), STEPS)
def test_each_step_is_in_the_rules(kind: str, step: str):
    text = (ROOT / "AGENTS.md").read_text(encoding="utf-8").split("## Adding a model")[1]
    places = {
        "file": f"`{RECIPES[kind].folder}/`",
        "export": "`__init__.pyi` of the package",
        "library": "`src/airmuscle/files/library/`",
        "example": "`tests/plants.py`",
        "exemption": "`NOT_IN_A_PLANT`",
        "nomenclature": "`release/make_nomenclature.py`",
    }
    assert places[step] in text
