"""Structure of the package: sizes of files and functions, names, docstrings, imports and faces."""

from __future__ import annotations

import ast
import functools
import gc
import importlib
import inspect
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

import airmuscle

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "airmuscle"
FILES = sorted(SOURCE.rglob("*.py"))
PACKAGES = sorted(path.parent for path in SOURCE.rglob("__init__.py"))
PHYSICS = re.compile(
    r"(?<![a-z])(muscle|pressure|valve|gas|contraction|force)(s|es)?(?![a-z])", re.IGNORECASE
)
# May be imported by other laws: the base, the solver, the validity range, the rubber of a wall.
SHARED_LAWS = {
    "base",
    "beyond_range",
    "calls",
    "data_scales",
    "modes",
    "rubber",
    "sampling",
    "solve",
    "validity_range",
}
# Laws made of other laws, and the package itself.
COMPOSITES = {"__init__", "scaled", "tangent", "polynomial_surrogate"}


def name_of(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


@functools.cache
def tree_of(path: Path) -> ast.Module:
    gc.disable()  # whose searches among the nodes, which all remain, take longer than parsing
    try:
        return ast.parse(path.read_text(encoding="utf-8"))
    finally:
        gc.enable()


def statements(tree: ast.Module) -> list[ast.AST]:
    """The statements of a file, also those inside others; expressions contain none."""
    found: list[ast.AST] = [tree]
    for node in found:  # which grows meanwhile
        for block in ("body", "orelse", "handlers", "finalbody", "cases"):
            inner = getattr(node, block, None)
            found += inner if isinstance(inner, list) else ()
    return found


# Files and names


def test_no_module_has_a_meaningless_name():
    names = {"util", "utils", "helper", "helpers", "common", "misc"}
    assert [name_of(p) for p in SOURCE.rglob("*") if p.stem.strip("_") in names] == []


def test_the_top_level_has_50_names_at_most():
    """Besides its subpackages, the errors and the parts of a muscle."""
    names = [name for name in airmuscle.__all__ if not inspect.ismodule(getattr(airmuscle, name))]
    assert len(names) <= 50


def test_names_that_are_imported_on_use_exist():
    """Of every face with a stub, which type checkers and the program read alike."""
    faces = [
        airmuscle,
        *(
            importlib.import_module(f"airmuscle.{path.parent.name}")
            for path in SOURCE.glob("*/*.pyi")
        ),
    ]
    assert {
        f"{face.__name__}.{name}"
        for face in faces
        for name in face.__all__
        if not hasattr(face, name)
    } == set()


def test_every_room_lists_its_names_alone():
    """In `dir`, which completes them in a notebook."""
    rooms = [
        importlib.import_module(f"airmuscle.{path.parent.name}")
        for path in SOURCE.glob("*/__init__.py")
    ]
    assert {room.__name__ for room in rooms if sorted(dir(room)) != sorted(room.__all__)} == set()


# Independence of packages and laws


@pytest.mark.parametrize("path", sorted((SOURCE / "engine" / "compile").rglob("*.py")), ids=name_of)
def test_the_compiler_contains_no_physics(path: Path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [f"{n}: {line}" for n, line in enumerate(lines, 1) if PHYSICS.search(line)] == []


def imported(path: Path) -> set[str]:
    """Full names of the modules that a file of the package imports, with relative imports
    resolved.
    """
    package = ["airmuscle", *path.relative_to(SOURCE).parts[:-1]]
    modules: set[str] = set()
    for node in statements(tree_of(path)):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*start, *([node.module] if node.module else [])])
            modules |= {module} | {f"{module}.{alias.name}" for alias in node.names}
    return modules


def floors_of(below: dict[str, set[str]]) -> dict[str, int]:
    """The floor of every room: one above the highest of those that it imports."""

    @functools.cache
    def floor(room: str) -> int:
        return 1 + max((floor(lower) for lower in below.get(room, ())), default=0)

    return {room: floor(room) for room in below}


def arrows_between(folder: Path) -> dict[str, set[str]]:
    """For every room of a package, a file or a folder in it, the rooms that it imports."""
    package = ".".join(["airmuscle", *folder.relative_to(SOURCE).parts])
    rooms = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()} - {
        "__init__",
        "__pycache__",
    }
    below: dict[str, set[str]] = {room: set() for room in rooms}
    for path in folder.rglob("*.py"):
        room = path.relative_to(folder).parts[0].removesuffix(".py")
        if room == "__init__":
            continue
        modules = {name for name in imported(path) if name.startswith(f"{package}.")}
        targets = {name.removeprefix(f"{package}.").split(".")[0] for name in modules}
        below[room] |= (targets & rooms) - {room}
    return below


def test_the_rooms_have_60_arrows_and_10_floors_at_most():
    """An arrow leads from a package (or `benchmarks/`) to another one that it imports; a floor is
    above all it imports.
    """
    rooms = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    below = {room: names & rooms for room, names in arrows_between(SOURCE).items() if room in rooms}
    below["benchmarks"] = {
        (node.module or "").split(".")[1]
        for path in (ROOT / "benchmarks").glob("*.py")
        for node in statements(tree_of(path))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airmuscle.")
    } & rooms
    assert len(below) <= 14
    assert max(floors_of(below).values()) <= 10
    assert sum(len(names) for names in below.values()) <= 60


def test_the_bench_has_12_rooms_8_floors_and_60_arrows_at_most():
    below = arrows_between(SOURCE / "bench")
    assert len(below) <= 12
    assert max(floors_of(below).values()) <= 8
    assert sum(len(names) for names in below.values()) <= 60


@pytest.mark.parametrize("room", sorted(arrows_between(SOURCE / "bench").keys() - {"reported"}))
def test_a_room_of_the_bench_has_60_arrows_inside_at_most(room: str):
    arrows = arrows_between(SOURCE / "bench" / room)
    assert sum(len(names) for names in arrows.values()) <= 60


def test_laws_do_not_import_each_other():
    laws = {
        path.stem: path for path in (SOURCE / "physics" / "muscle" / "characteristic").glob("*.py")
    }
    private = laws.keys() - SHARED_LAWS - COMPOSITES
    violations = {
        f"{law} imports {other}"
        for law in laws.keys() - COMPOSITES
        for other in private - {law}
        if f"airmuscle.physics.muscle.characteristic.{other}" in imported(laws[law])
    }
    assert violations == set()


def ruff(code: str, file: str) -> str:
    """The messages of ruff for this code in that file."""
    command = [sys.executable, "-m", "ruff", "check", "--no-cache", "--stdin-filename", file, "-"]
    return subprocess.run(command, input=code, cwd=ROOT, capture_output=True, text=True).stdout


@pytest.mark.parametrize("module", ["math", "numpy"])
@pytest.mark.parametrize(
    "file",
    [
        "muscle/characteristic/x.py",
        "muscle/friction/x.py",
        "pneumatics/x.py",
        "mechanism/x.py",
        "muscle/x.py",
    ],
)
def test_ruff_rejects_a_law_that_imports_math_or_numpy(file: str, module: str):
    for code in (
        f"import {module}\n\n{module}.sqrt(2.0)\n",
        f"from {module} import sqrt\n\nsqrt(2.0)\n",
    ):
        assert "TID251" in ruff(code, f"src/airmuscle/physics/{file}")


@pytest.mark.parametrize(
    "file",
    [
        "physics/muscle/characteristic/tabulated.py",
        "physics/muscle/characteristic/base.py",
        "physics/muscle/geometry/x.py",
        "core/ops.py",
        "report/x.py",
    ],
)
def test_ruff_accepts_math_and_numpy_elsewhere(file: str):
    assert "TID251" not in ruff("import math\n\nmath.sqrt(2.0)\n", f"src/airmuscle/{file}")


# Names and docstrings


def test_module_docstrings_begin_with_a_term():
    questions = ("What", "How", "Where", "Whether", "Which", "When")
    first_words = {
        name_of(path): re.split(r"\W", ast.get_docstring(tree_of(path)) or "")[0] for path in FILES
    }
    assert {name for name, word in first_words.items() if word in questions} == set()


def test_every_module_has_a_docstring():
    assert [name_of(path) for path in FILES if not ast.get_docstring(tree_of(path))] == []


def test_no_two_public_classes_share_a_name():
    modules = defaultdict(list)
    for path in FILES:
        for node in tree_of(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                modules[node.name].append(name_of(path))
    assert {name for name, paths in modules.items() if len(paths) > 1} == set()


def test_no_module_has_the_name_of_a_function_of_its_package():
    violations = set()
    for folder in PACKAGES:
        name = ".".join(["airmuscle", *folder.relative_to(SOURCE).parts])
        package = importlib.import_module(name)
        submodules = {path.stem for path in folder.iterdir()}
        functions = {
            name
            for name in getattr(package, "__all__", ())
            if inspect.isfunction(getattr(package, name))
        }
        violations |= {f"{package.__name__}.{name}" for name in submodules & functions}
    assert violations == set()


# Imports


def is_own(node: ast.AST) -> bool:
    """Whether a statement imports from airmuscle."""
    if isinstance(node, ast.ImportFrom):
        return node.level > 0 or (node.module or "").partition(".")[0] == "airmuscle"
    return isinstance(node, ast.Import) and any(
        alias.name.partition(".")[0] == "airmuscle" for alias in node.names
    )


def own_imports_below_the_top(path: Path) -> list[ast.AST]:
    """Imports from airmuscle inside functions, classes and conditions."""
    tree = tree_of(path)
    return [node for node in statements(tree) if is_own(node) and node not in tree.body]


def test_own_imports_are_at_the_top_of_a_file():
    """The command line imports the module of a command with importlib, from the table in
    cli/commands.py.
    """
    assert {name_of(path) for path in FILES if own_imports_below_the_top(path)} == set()


def test_annotations_are_evaluated():
    """Only a name that is defined later, or imported for the type checker alone, is quoted."""
    assert [
        name_of(path)
        for path in FILES
        if "from __future__ import annotations" in path.read_text("utf-8")
    ] == []


def test_modules_are_imported_by_name_in_few_files_only():
    files = {
        name_of(path) for path in FILES if "import_module(" in path.read_text(encoding="utf-8")
    }
    assert files <= {
        "core/stubs.py",  # names of the faces that are imported on use
        "__main__.py",  # the command line, within the handling of an interruption
        "outlets/cli/commands.py",  # the module of a command
        "outlets/cli/entry_point.py",  # the command line, after SIGINT is handled
        "engine/compile/cache/kernel.py",  # kernels that are not in the cache
        "files/library/fields.py",  # models named in TOML files
        # readers of laboratory formats, and those in native code
        "bench/readers/tables/separate_process.py",
        "papers/run.py",  # papers
        "engine/cluster.py",  # Dask
        "engine/stored_form.py",  # records of stored results
        "control/estimation/predictive_program.py",  # Ipopt in CasADi, an extra
        "design/audit/evaluate_function.py",  # functions of users, in a process of their own
    }


def test_options_of_commands_are_declared_in_requests():
    """Elsewhere only the options of all commands, and those for the output of a few, are declared
    for the parser.
    """
    files = {path.stem for path in FILES if "CommandOption(" in path.read_text(encoding="utf-8")}
    assert files <= {
        "parser",
        "requested",
        "options",
        "commands",
        "library",
        "simulate",
        "approximate",
        "submit",
        "tune",
    }


# Code for users


def code_for_users() -> Iterator[tuple[str, str]]:
    """(file, Python code) of the examples and of the code blocks of README.md and docs/."""
    for path in sorted((ROOT / "examples").glob("*.py")):
        yield f"examples/{path.name}", path.read_text(encoding="utf-8")
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        for block in re.findall(
            r"```python\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.DOTALL
        ):
            yield path.relative_to(ROOT).as_posix(), block


def face_of(module: str) -> frozenset[str] | None:
    """The names in `__all__` of a package, or of the exceptions, and its subpackages; None for any
    other module.
    """
    folder = SOURCE.parent.joinpath(*module.split("."))
    if not folder.is_dir() and module != "airmuscle.environments":
        return None
    names = getattr(importlib.import_module(module), "__all__", ())
    return frozenset(names) | {path.parent.name for path in folder.glob("*/__init__.py")}


def is_module(name: str) -> bool:
    return SOURCE.parent.joinpath(*name.split(".")).with_suffix(".py").is_file()


def names_outside_faces(code: str) -> Iterator[str]:
    """Imported modules that are no rooms, and imported names that are not in `__all__` of their
    room.
    """
    for node in statements(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and is_own(node):
            face = face_of(node.module) if node.module.count(".") <= 1 else None
            if face is None:
                yield node.module
            else:
                yield from (
                    f"{node.module}.{alias.name}" for alias in node.names if alias.name not in face
                )
        elif isinstance(node, ast.Import) and is_own(node):
            yield from (alias.name for alias in node.names if face_of(alias.name) is None)


def test_code_for_users_imports_from_faces_only():
    violations = {
        f"{file}: {name}" for file, code in code_for_users() for name in names_outside_faces(code)
    }
    assert violations == set()


def test_an_import_that_is_not_from_a_face_is_detected():
    code = (
        "from airmuscle.units import bar, no_unit\nfrom airmuscle.core.errors import"
        " FileError\nimport airmuscle.core.ops"
    )
    assert list(names_outside_faces(code)) == [
        "airmuscle.units.no_unit",
        "airmuscle.core.errors",
        "airmuscle.core.ops",
    ]


def test_all_exceptions_are_in_airmuscle_errors():
    from airmuscle import errors
    from airmuscle.core import errors as core_errors
    from airmuscle.core import extras

    defined = {
        name: thing
        for module in (core_errors, extras)
        for name, thing in vars(module).items()
        if inspect.isclass(thing) and issubclass(thing, Exception | Warning)
    }
    assert set(defined) == set(errors.__all__)
    assert all(getattr(errors, name) is defined[name] for name in errors.__all__)
    assert all(name in (errors.__doc__ or "") for name in errors.__all__)


def test_tests_import_inner_modules_119_times_at_most():
    """They import from the faces, so that a file can be moved; what they test within a room they
    import from its file.

    Names that a stub has for the other rooms alone count as well; the import of a module by its
    package does not.
    """
    inner = [
        (path, node.module)
        for path in (ROOT / "tests").rglob("*.py")
        for node in statements(tree_of(path))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("airmuscle.")
        if (face := face_of(node.module)) is None
        or any(
            not (alias.name in face or is_module(f"{node.module}.{alias.name}"))
            for alias in node.names
        )
    ]
    assert len(inner) <= 119
