"""Installation: the lock pins every requirement and contains no address; `./run` starts quickly if
it is installed.
"""

import importlib.machinery
import importlib.resources
import importlib.util
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import jinja2
import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCKS = {
    name: (ROOT / "locks" / name).read_text(encoding="utf-8")
    for name in ("requirements.lock", "requirements-dev.lock")
}
ADDED = ("docs", "tools")
ADDED_LOCKS = {
    f"requirements-{name}.lock": (ROOT / "locks" / f"requirements-{name}.lock").read_text("utf-8")
    for name in ADDED
}
every = pytest.mark.parametrize(
    "lock", [*LOCKS.values(), *ADDED_LOCKS.values()], ids=[*LOCKS, *ADDED_LOCKS]
)


# The lock


def requirements(lock: str) -> list[str]:
    """The requirements of a lock, each with its hashes."""
    return re.split(r"(?<!\\)\n", lock.strip())


@every
def test_the_lock_contains_no_address(lock: str):
    assert not re.search(r"://|^\s*-(-index|-extra|-find|-trusted|i|f)\b|@ ", lock, re.MULTILINE)
    assert [
        path.name for path in ROOT.iterdir() if re.fullmatch(r"uv\.lock|pylock.*\.toml", path.name)
    ] == []


@every
def test_every_requirement_is_pinned_and_hashed(lock: str):
    for entry in requirements(lock):
        assert re.match(r"[a-z0-9-]+==\S+ ", entry), entry
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), entry


@pytest.mark.parametrize(
    ("lock", "extras"),
    [("requirements.lock", ["build", "sim"]), ("requirements-dev.lock", ["dev", "build", "sim"])],
)
def test_the_lock_contains_all_dependencies_of_the_project(lock: str, extras: list[str]):
    project = PROJECT["project"]
    added = [line for extra in extras for line in project["optional-dependencies"][extra]]
    required = project["dependencies"] + added
    locked = {entry.split("==")[0] for entry in requirements(LOCKS[lock])}
    assert {re.split(r"[^\w.-]", line)[0].lower() for line in required} <= locked


def test_the_program_is_installed_without_the_packages_of_the_checks():
    program, everything = (set(requirements(lock)) for lock in LOCKS.values())
    assert program < everything
    assert not {"pytest", "mypy", "ruff", "hypothesis", "dask"} & {
        entry.split("==")[0] for entry in program
    }


@pytest.mark.parametrize("added", ADDED_LOCKS.values(), ids=ADDED_LOCKS)
def test_added_packages_do_not_change_those_of_the_program(added: str):
    others = dict(pinned for lock in LOCKS.values() for pinned in pins(lock))
    changed = {name for name, version in pins(added) if others.get(name, version) != version}
    assert changed == set()


def pins(lock: str) -> list[tuple[str, str]]:
    """(name with its condition, version) of each requirement of a lock."""
    found = [re.match(r"([a-z0-9-]+)==(\S+)((?: ;[^\\]*)?)", entry) for entry in requirements(lock)]
    return [(f"{match[1]}{match[3].rstrip()}", match[2]) for match in found if match]


def test_the_engine_is_an_extra_that_the_checks_and_the_first_line_of_the_readme_install():
    project = PROJECT["project"]
    extras = project["optional-dependencies"]
    assert {"numba", "llvmlite"} <= {line.partition(">=")[0] for line in extras["sim"]}
    assert not set(extras["sim"]) & set(project["dependencies"])
    assert set(extras["sim"]) <= set(extras["dev"])
    lines = re.findall(
        r"^pip install (\S+)", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert lines == ['"airmuscle[sim]"']


def test_all_files_of_a_release_state_the_same_version():
    version = PROJECT["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert (
        json.loads((ROOT / "release" / "codemeta.json").read_text(encoding="utf-8"))["version"]
        == version
    )
    assert recipe()["package"]["version"] == version


def recipe() -> dict[str, Any]:
    """The conda recipe, rendered as conda-build does."""
    text = (ROOT / "release" / "conda" / "meta.yaml").read_text(encoding="utf-8")
    return yaml.safe_load(jinja2.Template(text).render(PYTHON="python"))


def test_the_conda_recipe_has_the_dependencies_of_the_package():
    """Its form alone: no conda-build is at hand."""
    stated = {
        line.replace("matplotlib-base", "matplotlib").replace(" ", "")
        for line in recipe()["requirements"]["run"]
    }
    project = PROJECT["project"]
    engine = project["optional-dependencies"]["sim"]
    assert stated == {f"python{project['requires-python']}", *project["dependencies"], *engine}
    assert recipe()["about"]["license"] == project["license"]
    assert recipe()["about"]["license_file"] == project["license-files"]
    assert {"source", "build", "requirements", "test", "about", "extra"} < set(recipe())


def release_metadata() -> ModuleType:
    path = ROOT / "release" / "metadata.py"
    module = importlib.util.module_from_spec(
        importlib.util.spec_from_file_location("metadata", path)
    )
    importlib.machinery.SourceFileLoader("metadata", str(path)).exec_module(module)
    return module


def test_links_of_the_readme_hold_outside_the_repository():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    portable = release_metadata().portable_readme
    relative = re.findall(r"\]\((?!https?://)([^)]+)\)", readme)
    text = portable(readme, "")
    assert len(relative) > 10
    assert "](" not in text
    assert "All commands at a glance" in text
    text = portable(readme, "https://forge.example/group/airmuscle/")
    assert not re.search(r"\]\((?!https?://)", text)
    assert "](https://forge.example/group/airmuscle/raw/main/docs/images/chain.png)" in text
    assert "](https://forge.example/group/airmuscle/blob/main/docs/tutorials/commands.md)" in text
    assert portable("[a](https://x.org/b) ![](c.png)", "") == "[a](https://x.org/b) "


@pytest.mark.parametrize("repository", ["", "https://forge.example/group/airmuscle"])
def test_a_package_has_addresses_where_the_repository_is_known(repository: str):
    metadata: dict[str, Any] = {}
    release_metadata().ReleaseMetadata(str(ROOT), {"repository": repository}).update(metadata)
    assert metadata["urls"].get("Repository", "") == repository
    assert metadata["readme"]["text"].startswith("# airmuscle")
    assert ("Changelog" in metadata["urls"]) == bool(repository)


def test_the_package_contains_the_marker_of_its_type_annotations():
    assert (importlib.resources.files("airmuscle") / "py.typed").is_file()


# ./run


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of `run` and of the files that it reads, with an environment that appears complete."""
    folder = tmp_path / "a folder with spaces"
    (folder / ".venv" / "bin").mkdir(parents=True)
    (folder / "locks").mkdir()
    locks = [f"locks/{name}" for name in (*ADDED_LOCKS, *LOCKS)]
    for name in ("run", "pyproject.toml", *locks):
        (folder / name).write_bytes((ROOT / name).read_bytes())
    (folder / ".venv" / "bin" / "python").symlink_to(sys.executable)
    (folder / ".venv" / "airmuscle.stamp").write_bytes(b"".join(load_run(folder).stamp()))
    return folder


def load_run(folder: Path) -> ModuleType:
    loader = importlib.machinery.SourceFileLoader("run", str(folder / "run"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("run", loader))
    loader.exec_module(module)
    return module


needs_posix = pytest.mark.skipif(
    os.name == "nt", reason="the environment of this test is made of symbolic links"
)


@needs_posix
def test_a_second_start_adds_less_than_a_fifth_of_a_second(checkout: Path):
    """Of CPU time, because other processes may run on the machine."""

    def seconds() -> float:
        before = os.times()
        subprocess.run([sys.executable, checkout / "run", "true"], check=True)
        after = os.times()
        return (
            after.children_user
            - before.children_user
            + after.children_system
            - before.children_system
        )

    assert min(seconds() for _ in range(5)) < 0.2


@needs_posix
def test_run_passes_arguments_and_exit_code(checkout: Path):
    code = "import sys; print(sys.argv[1:]); sys.exit(7)"
    command = [sys.executable, checkout / "run", "python", "-c", code, "two words", "--help"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (7, "['two words', '--help']\n")


@needs_posix
def test_an_unknown_command_gives_one_line(checkout: Path):
    done = subprocess.run(
        [sys.executable, checkout / "run", "no-such-thing"], capture_output=True, text=True
    )
    assert done.returncode == 127
    assert done.stderr == "run: no command 'no-such-thing' in the environment or on the path\n"


@needs_posix
@pytest.mark.parametrize("changed", ["pyproject.toml", *(f"locks/{name}" for name in LOCKS)])
def test_a_changed_project_or_lock_invalidates_the_stamp(checkout: Path, changed: str):
    with (checkout / changed).open("a") as file:
        file.write("\n# changed\n")
    assert load_run(checkout).read(str(checkout / ".venv" / "airmuscle.stamp")) != b"".join(
        load_run(checkout).stamp()
    )


@needs_posix
def test_a_demo_and_the_program_do_not_need_the_packages_of_the_checks(checkout: Path):
    run = load_run(checkout)
    stamp = checkout / ".venv" / "airmuscle.stamp"
    stamp.write_bytes(b"".join(run.stamp()[:2]))
    assert run.installed(everything=False)
    assert not run.installed(everything=True)
    stamp.write_bytes(b"".join(run.stamp()))
    assert run.installed(everything=False)


@needs_posix
@pytest.mark.parametrize("everything", [False, True])
def test_an_installation_uses_the_locks_that_the_command_needs(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, everything: bool
):
    run = load_run(checkout)
    called = []
    (checkout / ".venv" / "airmuscle.stamp").write_bytes(b"old")
    monkeypatch.setattr(subprocess, "call", lambda command, **settings: called.append(command[-1]))
    assert run.install(everything) is None
    locks = ["requirements.lock", "requirements-dev.lock"] if everything else ["requirements.lock"]
    assert [Path(name).name for name in called[1:-2]] == locks
    assert called[-1] == str(checkout / ".venv" / "lib")  # is compiled when all packages are there
    assert run.installed(everything)


@needs_posix
@pytest.mark.parametrize("name", ADDED)
def test_further_packages_are_added_once_and_keep_the_stamp_of_the_program(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    run = load_run(checkout)
    called = []
    monkeypatch.setattr(subprocess, "call", lambda command, **settings: called.append(command[-1]))
    assert run.install_added(name) is None
    assert run.install_added(name) is None
    assert [Path(lock).name for lock in called] == [f"requirements-{name}.lock", "lib"]
    assert run.installed(everything=True)


@needs_posix
def test_an_installation_that_fails_leaves_no_stamp(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
):
    run = load_run(checkout)
    (checkout / "locks" / "requirements.lock").write_text("")
    monkeypatch.setattr(subprocess, "call", lambda *args, **settings: 1)
    assert run.install() == "could not install .venv; see the messages above"
    assert not (checkout / ".venv" / "airmuscle.stamp").exists()


@needs_posix
def test_the_error_of_a_python_without_ensurepip_names_the_missing_package(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    assert re.search(r"sudo apt install python3\.\d+-venv$", load_run(checkout).install())
