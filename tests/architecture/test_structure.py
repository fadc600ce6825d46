"""The house: what holds for every file, whatever it is about.

The lock installs the same bytes everywhere and names no registry. Files and functions stay short.
The engine knows no physics, laws know neither each other nor NumPy. `./run` starts at once when
its environment is there.
"""

import ast
import importlib.machinery
import importlib.util
import os
import re
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "airmuscle"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
FILES = sorted(SOURCE.rglob("*.py"))
PHYSICS = re.compile(r"(?<![a-z])(muscle|pressure|valve|gas|contraction|force)(s|es)?(?![a-z])", re.IGNORECASE)
# May be imported by their siblings: the base, the search, a wall's rubber, and laws made of other laws.
SHARED_LAWS = {"base", "solve", "validity_range", "rubber"}
COMPOSITES = {"__init__", "scaled", "tangent", "polynomial_surrogate"}


def name_of(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


# The lock


def requirements() -> list[str]:
    """One requirement an entry, with its hashes."""
    return re.split(r"(?<!\\)\n", LOCK.strip())


def test_the_lock_names_no_address():
    assert not re.search(r"://|^\s*-(-index|-extra|-find|-trusted|i|f)\b|@ ", LOCK, re.MULTILINE)
    assert [path.name for path in ROOT.iterdir() if re.fullmatch(r"uv\.lock|pylock.*\.toml", path.name)] == []


def test_every_requirement_is_pinned_and_hashed():
    for entry in requirements():
        assert re.match(r"[a-z0-9-]+==\S+ ", entry), entry
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), entry


def test_the_lock_holds_all_the_project_asks_for():
    project = PROJECT["project"]
    asked = project["dependencies"] + project["optional-dependencies"]["dev"]
    locked = {entry.split("==")[0] for entry in requirements()}
    assert {re.split(r"[^\w.-]", line)[0].lower() for line in asked} <= locked


def test_the_citation_and_the_package_state_the_same_version():
    version = PROJECT["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


# Files, functions, names


def test_files_have_300_lines_at_most():
    lengths = {name_of(path): len(path.read_text(encoding="utf-8").splitlines()) for path in FILES}
    assert {name: n for name, n in lengths.items() if n > 300} == {}


def body_length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines from `def` to the end, the docstring not counted: a formula may take its room."""
    documented = ast.get_docstring(function) is not None
    docstring = function.body[0].end_lineno - function.body[0].lineno + 1 if documented else 0
    return function.end_lineno - function.lineno + 1 - docstring


def test_functions_have_40_lines_at_most():
    found = {
        f"{name_of(path)}:{node.lineno} {node.name}": body_length(node)
        for path in FILES
        if SOURCE / "compile" / "kernels" not in path.parents  # kernels are one loop each
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    assert {name: n for name, n in found.items() if n > 40} == {}


def test_no_file_is_a_drawer_for_odds_and_ends():
    drawers = {"util", "utils", "helper", "helpers", "common", "misc"}
    assert [name_of(p) for p in SOURCE.rglob("*") if p.stem.strip("_") in drawers] == []


def test_the_top_level_has_40_names_at_most():
    airmuscle = pytest.importorskip("airmuscle")
    names = getattr(airmuscle, "__all__", ())
    assert len(names) <= 40
    assert [name for name in names if not hasattr(airmuscle, name)] == []


# Who may know whom


@pytest.mark.parametrize("path", sorted((SOURCE / "compile").rglob("*.py")), ids=name_of)
def test_the_engine_names_no_physics(path: Path):
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [f"{n}: {line}" for n, line in enumerate(lines, 1) if PHYSICS.search(line)] == []


def imported(path: Path) -> set[str]:
    """Full names of the modules a file of the package imports, relative imports resolved."""
    package = ["airmuscle", *path.relative_to(SOURCE).parts[:-1]]
    found: set[str] = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*start, *([node.module] if node.module else [])])
            found |= {module} | {f"{module}.{alias.name}" for alias in node.names}
    return found


def test_laws_do_not_import_each_other():
    laws = {path.stem: path for path in (SOURCE / "characteristic").glob("*.py")}
    private = laws.keys() - SHARED_LAWS - COMPOSITES
    found = {
        f"{law} imports {other}"
        for law in laws.keys() - COMPOSITES
        for other in private - {law}
        if f"airmuscle.characteristic.{other}" in imported(laws[law])
    }
    assert found == set()


def ruff(code: str, place: str) -> str:
    """What ruff says of this code, were it in that file."""
    command = [sys.executable, "-m", "ruff", "check", "--no-cache", "--stdin-filename", place, "-"]
    return subprocess.run(command, input=code, cwd=ROOT, capture_output=True, text=True).stdout


@pytest.mark.parametrize("module", ["math", "numpy"])
@pytest.mark.parametrize("file", ["characteristic/x.py", "pneumatics/x.py", "mechanism/x.py", "muscle/x.py"])
def test_a_law_that_imports_math_or_numpy_is_refused(file: str, module: str):
    for code in (f"import {module}\n\n{module}.sqrt(2.0)\n", f"from {module} import sqrt\n\nsqrt(2.0)\n"):
        assert "TID251" in ruff(code, f"src/airmuscle/{file}")


@pytest.mark.parametrize(
    "file", ["characteristic/tabulated.py", "characteristic/base.py", "core/ops.py", "report/x.py"]
)
def test_elsewhere_math_and_numpy_are_welcome(file: str):
    assert "TID251" not in ruff("import math\n\nmath.sqrt(2.0)\n", f"src/airmuscle/{file}")


# ./run


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """`run`, what it reads, and an environment that it takes for finished."""
    place = tmp_path / "a place with spaces"
    (place / ".venv" / "bin").mkdir(parents=True)
    for name in ("run", "pyproject.toml", "requirements.lock"):
        (place / name).write_bytes((ROOT / name).read_bytes())
    (place / ".venv" / "bin" / "python").symlink_to(sys.executable)
    (place / ".venv" / "airmuscle.stamp").write_bytes(b"".join(run_of(place).stamp()))
    return place


def run_of(place: Path) -> ModuleType:
    loader = importlib.machinery.SourceFileLoader("run", str(place / "run"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("run", loader))
    loader.exec_module(module)
    return module


needs_posix = pytest.mark.skipif(os.name == "nt", reason="the stand-in environment is made of symbolic links")


@needs_posix
def test_a_second_start_adds_less_than_a_fifth_of_a_second(checkout: Path):
    def seconds() -> float:
        start = time.perf_counter()
        subprocess.run([sys.executable, checkout / "run", "true"], check=True)
        return time.perf_counter() - start

    assert min(seconds() for _ in range(5)) < 0.2


@needs_posix
def test_run_hands_on_arguments_and_exit_code(checkout: Path):
    code = "import sys; print(sys.argv[1:]); sys.exit(7)"
    command = [sys.executable, checkout / "run", "python", "-c", code, "two words", "--help"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (7, "['two words', '--help']\n")


@needs_posix
def test_an_unknown_command_is_one_line(checkout: Path):
    done = subprocess.run([sys.executable, checkout / "run", "no-such-thing"], capture_output=True, text=True)
    assert done.returncode == 127
    assert done.stderr == "run: no command 'no-such-thing' in the environment or on the path\n"


@needs_posix
@pytest.mark.parametrize("changed", ["pyproject.toml", "requirements.lock"])
def test_another_project_or_lock_makes_the_stamp_stale(checkout: Path, changed: str):
    with (checkout / changed).open("a") as file:
        file.write("\n# changed\n")
    assert run_of(checkout).read(str(checkout / ".venv" / "airmuscle.stamp")) != b"".join(run_of(checkout).stamp())


@needs_posix
def test_an_installation_that_fails_leaves_no_stamp(checkout: Path, monkeypatch: pytest.MonkeyPatch):
    run = run_of(checkout)
    (checkout / "requirements.lock").write_text("")
    monkeypatch.setattr(subprocess, "call", lambda *args, **settings: 1)
    assert run.install() == "could not install .venv; the reason stands above"
    assert not (checkout / ".venv" / "airmuscle.stamp").exists()


@needs_posix
def test_a_python_without_ensurepip_is_told_what_to_install(checkout: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert re.search(r"sudo apt install python3\.\d+-venv$", run_of(checkout).install())
