"""Nomenclature: the page is generated from the declarations, and contains every public argument."""

from __future__ import annotations

import ast
import dataclasses
import importlib.util
import inspect
import re
from pathlib import Path

import airmuscle
from airmuscle import bench, control, design, engine, files, outlets, physics
from airmuscle.core import parameters
from airmuscle.files.library import model_class, model_names
from airmuscle.recording import QUANTITIES

DOCS = Path(__file__).parents[2] / "docs"
SOURCE = DOCS.parent / "src"


def load_generator():
    spec = importlib.util.spec_from_file_location(
        "make_nomenclature", DOCS.parent / "release" / "make_nomenclature.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date():
    written = (DOCS / "reference/nomenclature.md").read_text(encoding="utf-8")
    generated = load_generator().page()
    missing = [
        name
        for name in model_names()
        if f"### {name}\n" in generated and f"### {name}\n" not in written
    ]
    reports = [f"run release/make_nomenclature.py: {name} is missing" for name in missing]
    assert not missing, "\n".join(reports)
    assert written == generated, "run release/make_nomenclature.py"


def public_arguments():
    """(owner, argument) of every public function and method in the face of the package, and of
    every model.
    """
    classes = [model_class(name, "test") for name in model_names()]
    exported = [getattr(airmuscle, name) for name in airmuscle.__all__]
    for thing in [*exported, *classes]:
        if inspect.isfunction(thing):
            yield from ((thing.__name__, a) for a in inspect.signature(thing).parameters)
        elif inspect.isclass(thing):
            for name, member in vars(thing).items():
                if not name.startswith("_") and inspect.isfunction(member):
                    yield from (
                        (f"{thing.__name__}.{name}", a)
                        for a in inspect.signature(member).parameters
                    )
            if dataclasses.is_dataclass(thing):
                yield from ((thing.__name__, f.name) for f in dataclasses.fields(thing) if f.init)


def test_no_public_argument_is_missing_from_the_nomenclature():
    declared = {
        p.name
        for name in model_names()
        if dataclasses.is_dataclass(model_class(name, ""))
        for p in parameters(model_class(name, ""))
    }
    known = declared | set(QUANTITIES) | set(load_generator().ARGUMENTS) | {"self", "cls"}
    missing = sorted(
        {f"{argument} ({where})" for where, argument in public_arguments() if argument not in known}
    )
    assert not missing, (
        f"add to release/make_nomenclature.py, or use a name that is there: {missing}"
    )


def test_every_argument_of_the_nomenclature_exists():
    """As an argument or an annotated field somewhere in the package."""
    nodes = [
        node
        for path in SOURCE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    ]
    fields = {
        n.target.id
        for n in nodes
        if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)
    }
    assert (
        set(load_generator().ARGUMENTS) - {n.arg for n in nodes if isinstance(n, ast.arg)} - fields
        == set()
    )


def test_every_parameter_has_unit_symbol_meaning_and_bounds():
    for name in model_names():
        cls = model_class(name, "test")
        for p in parameters(cls) if dataclasses.is_dataclass(cls) else ():
            assert p.unit, f"{name}.{p.name}"
            assert p.symbol, f"{name}.{p.name}"
            assert len(p.meaning) > 3, f"{name}.{p.name}"
            assert p.bounds[0] < p.bounds[1], f"{name}.{p.name}"


MODELS = {"law", "friction", "plant", "arm", "fit", "elements"}
MEASURED = {"recording", "recordings", "experiment", "experiments", "episodes", "loop_fits"}


def test_the_model_stands_before_the_measurements():
    """In every function of a room, as in `fit(law, recordings)`."""
    wrong = set()
    for room in (bench, control, design, engine, files, outlets, physics):
        for function in filter(inspect.isfunction, (getattr(room, name) for name in room.__all__)):
            names = [
                p.name
                for p in inspect.signature(function).parameters.values()
                if p.kind is not p.KEYWORD_ONLY
            ]
            kinds = [name in MEASURED for name in names if name in MODELS | MEASURED]
            if kinds != sorted(kinds):
                wrong.add(f"{function.__name__}({', '.join(names)})")
    assert wrong == set()


OTHER_WORDS_FOR_A_BRANCH = re.compile(
    r"\b(rising|falling|loading|unloading|forward|backward) (branch|and (a |the )?\w+ branch)"
)


def test_a_branch_of_a_measured_run_is_inflating_deflating_contracting_or_extending():
    """The branches of an equilibrium path (a snap-through) are those of a figure of a paper."""
    texts = [
        *SOURCE.rglob("*.py"),
        *SOURCE.rglob("*.js"),
        *DOCS.rglob("*.md"),
        DOCS.parent / "README.md",
    ]
    found = [
        f"{path.name}: {match[0]}"
        for path in texts
        for match in OTHER_WORDS_FOR_A_BRANCH.finditer(path.read_text(encoding="utf-8"))
    ]
    assert not found
