"""Type checkers pass over every block of Python of the README and of the documentation."""

from __future__ import annotations

import ast
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from code_blocks import python_blocks

import airmuscle
from airmuscle.files import list_laws, list_plants, list_products, list_valves

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
GIVEN = {
    "docs/guides/dynamic-identification.md": ("recording", "command", "plant", "another"),
    "docs/guides/warp.md": ("builder", "dof", "wp"),
}
"""Names that a page takes as given in a block that is a part of a program."""
STUB = Path(airmuscle.__file__).parent / "files" / "library" / "entry_by_name.pyi"
SETTINGS = ("--ignore-missing-imports", "--allow-redefinition-new", "--local-partial-types")
"""A block may give a name another meaning than the block before it."""
PYRIGHT = {
    "typeCheckingMode": "standard",
    "include": ["."],
    "reportMissingImports": False,
    "reportUnusedExpression": False,
    # a controller may state a class attribute in place of a property of its interface
    "reportAssignmentType": False,
    "reportIncompatibleMethodOverride": False,
}
UNTYPED = ("mujoco",)
"""Packages of pages whose compiled modules have no types."""


def code_of(page: Path) -> str:
    """The blocks of a page as one module."""
    given = GIVEN.get(page.relative_to(ROOT).as_posix(), ())
    lines = ["from typing import Any", *(f"{name}: Any = None" for name in given)] if given else []
    return "\n".join([*lines, *python_blocks(page)])


@pytest.fixture
def modules(tmp_path: Path) -> Path:
    """The folder of a module for each page with code."""
    for page in PAGES:
        if python_blocks(page):
            name = re.sub(r"\W", "_", page.relative_to(ROOT).with_suffix("").as_posix())
            (tmp_path / f"{name}.py").write_text(code_of(page), encoding="utf-8")
    assert len(list(tmp_path.glob("*.py"))) > 30
    return tmp_path


def test_mypy_passes_over_every_block(modules: Path):
    command = [sys.executable, "-m", "mypy", *SETTINGS, "--follow-imports=silent"]
    cache = ROOT / ".mypy_cache" / "pages"
    files = sorted(path.name for path in modules.glob("*.py"))
    done = subprocess.run(
        [*command, "--cache-dir", str(cache), *files], cwd=modules, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]


@pytest.mark.tool
def test_pyright_passes_over_every_block(modules: Path):
    program = shutil.which("basedpyright") or shutil.which("pyright")
    if program is None:
        pytest.skip("needs pyright or basedpyright")
    (modules / "pyrightconfig.json").write_text(json.dumps(PYRIGHT), encoding="utf-8")
    for package in UNTYPED:
        stub = modules / "typings" / package / "__init__.pyi"
        stub.parent.mkdir(parents=True)
        stub.write_text("from typing import Any\ndef __getattr__(name: str) -> Any: ...\n")
    command = [program, "--pythonpath", sys.executable, "--project", str(modules)]
    done = subprocess.run(command, cwd=modules, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:]


@pytest.mark.parametrize(
    ("entry", "names"),
    [
        ("Entry", list_laws()),
        ("ValveEntry", list_valves()),
        ("PlantEntry", list_plants()),
        ("ProductEntry", list_products()),
    ],
)
def test_the_stub_states_the_type_of_each_name_of_the_library(entry: str, names: tuple[str, ...]):
    """A new entry of the library is added to its list in entry_by_name.pyi."""
    stated = {
        ast.unparse(function.returns): re.findall(r"'([^']+)'", ast.unparse(function.args))
        for function in ast.parse(STUB.read_text(encoding="utf-8")).body
        if isinstance(function, ast.FunctionDef)
    }
    assert stated[entry] == list(names)
    assert type(airmuscle.load(names[0])).__name__ == entry
