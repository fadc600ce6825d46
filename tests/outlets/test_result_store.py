"""Stored results of tasks: what comes back is what was computed, to the last bit, or it is computed
anew and said.

Whatever is done to the files and to the folder: no other number is returned, no exception raised,
and nothing waited for. A key depends on all that determines a result, and on nothing else.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import pickle
import random
import signal
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import stored_task
from cluster_commands import COMMANDS, FEW, write_inputs
from command_line import airmuscle

from airmuscle import Recording, load, load_data
from airmuscle.bench import fit
from airmuscle.core import AbsolutePressure, Hint
from airmuscle.design import result_store
from airmuscle.engine.content import content_digest
from airmuscle.engine.distribution import DistributedCalls
from airmuscle.engine.stored_form import NotStorableError, decode, encode
from airmuscle.errors import InputError
from airmuscle.physics import Dahl

TASKS = (3, 5, 8, 13)
STORE_FOLDER = "tasks"


# Stored form

VALUES = {
    "plain": [None, True, 3, "text \n\u2028", 0.1, -0.0, math.inf, 1e-320],
    "tuples": (1, (2.0, "x"), [(), {}]),
    "table": {"a": 1, ("b", 2): {"c": np.float64(0.1)}, 3.0: None},
    "counts": Counter("abca"),
    "range": range(2, 9, 3),
    "arrays": [np.eye(3), np.asfortranarray(np.eye(2, 3)), np.zeros((0, 4)), np.arange(3)[::-1]],
    "texts": np.array(["", "a", "long"]),
    "mask": np.array([True, False]),
    "absolute": AbsolutePressure(7e5, 1e5),
    "hinted": InputError("text", hint=Hint("To do so", "by", 3)).message,
    "recording": load_data("dmsp-20-300"),
    "law": load("dmsp-20-300").characteristic,
    "friction": Dahl(20.0, 1e4),
}


@pytest.mark.parametrize("name", VALUES)
def test_a_value_comes_back_as_it_was(name: str):
    value = VALUES[name]
    back = decode(encode(value))
    assert type(back) is type(value)
    assert content_digest(back) == content_digest(value)


def test_arrays_keep_their_order_in_memory_and_whether_they_can_be_written_to():
    fixed = np.zeros(3)
    fixed.setflags(write=False)
    rows, columns, still = decode(encode([np.eye(3), np.asfortranarray(np.eye(3)), fixed]))
    assert rows.flags.c_contiguous
    assert columns.flags.f_contiguous
    assert not columns.flags.c_contiguous
    assert (rows.flags.writeable, still.flags.writeable) == (True, False)


def test_a_constant_that_a_worker_process_sent_is_the_constant():
    sent = pickle.loads(pickle.dumps(dataclasses.MISSING))
    assert decode(encode(sent)) is dataclasses.MISSING


def test_what_occurs_twice_is_one_object():
    one = load("dmsp-20-300").characteristic
    first, second = decode(encode([one, one]))
    assert first is second


def test_a_fit_comes_back_with_its_remarks():
    original = fit(load("dmsp-20-300").characteristic, load_data("dmsp-20-300"))
    back = decode(encode(original))
    assert str(back) == str(original)
    assert np.array_equal(back.covariance, original.covariance)


@dataclasses.dataclass(frozen=True)
class Foreign:
    """A record that is not of the program."""

    value: float = 1.0


@pytest.mark.parametrize(
    "value",
    [Foreign(), {"a": object()}, print, {1, 2}, np.array([None])],
    ids=lambda value: type(value).__name__,
)
def test_objects_of_others_have_no_stored_form(value):
    with pytest.raises(NotStorableError, match="have no stored form"):
        encode(value)


@pytest.mark.parametrize(
    "name", ["os:system", "builtins:eval", "airmuscle.core.tree:fingerprint", "airmuscle.none:X"]
)
def test_no_name_in_a_stored_form_is_called(name: str):
    content = {"value": {"record": 0}, "records": [[name, {}]], "arrays": []}
    with pytest.raises((ValueError, ImportError)):
        decode(json.dumps(content).encode() + b"\n")


# Keys


def test_a_digest_is_the_same_in_every_process():
    """Sets have another order in each process; a model has other derived values."""
    code = (
        "from airmuscle import load, load_data\n"
        "from airmuscle.engine.content import content_digest\n"
        "print(content_digest({'b', 'a', 'c'}, load('dmsp-20-300').characteristic,"
        " load_data('dmsp-20-300')))"
    )
    law = load("dmsp-20-300").characteristic
    law.force(1e5, 0.1)
    here = content_digest({"c", "a", "b"}, law, load_data("dmsp-20-300"))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == here


RECORDING = Recording({"pressure": np.arange(3.0)}, "run", {"resting_length": 0.3})


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (1, 1.0),
        (0.1, np.nextafter(0.1, 1)),
        ("a", b"a"),
        ((1, 2), [1, 2]),
        ({1}, {2}),
        (np.arange(6), np.arange(6).reshape(2, 3)),
        (np.zeros(2), np.zeros(2, np.float32)),
        (AbsolutePressure(2e5, 1e5), 1e5),
        (math.hypot, math.dist),
        (stored_task.column, content_digest),
        (RECORDING, dataclasses.replace(RECORDING, origin="other")),
        (RECORDING, dataclasses.replace(RECORDING, constants={"resting_length": 0.31})),
    ],
    ids=lambda value: type(value).__name__,
)
def test_every_change_changes_a_digest(one, other):
    assert content_digest(one) != content_digest(other)


def test_a_function_without_a_name_has_no_digest():
    with pytest.raises(InputError, match="defined within a function"):
        content_digest(lambda: 1)


def test_the_text_of_a_user_is_part_of_the_digest(tmp_path: Path):
    """Of a class of the user, whose code may change without its name."""
    digests = []
    for gain in (1.0, 2.0):
        (tmp_path / "mine.py").write_text(f"def law(x):\n    return {gain} * x\n", encoding="utf-8")
        code = "import mine\nfrom airmuscle.engine.content import content_digest as d\nprint(d(mine.law))"
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True
        )
        digests.append(done.stdout)
    assert digests[0] != digests[1]


# Files that were damaged, exchanged or put there by others


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """A folder with the results of all tasks."""
    folder = tmp_path / STORE_FOLDER
    assert_right(folder)
    assert len(results(folder)) == len(TASKS)
    return folder


def results(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.result"))


def assert_right(folder: Path) -> tuple[int, str]:
    """Compute the tasks with a store, and compare them; the number computed, and what was said."""
    stored_task.CALLS.clear()
    with warnings.catch_warnings(record=True) as said, result_store(folder):
        warnings.simplefilter("always")
        found = DistributedCalls(None, stored_task.column, 0.1).results(TASKS)
    for result, count in zip(found, TASKS, strict=True):
        assert result["text"] == f"{count} rows"
        assert np.array_equal(result["values"], 0.1 * np.arange(float(count)) / 7.0)
    return len(stored_task.CALLS), "\n".join(str(each.message) for each in said)


def test_stored_results_are_not_computed_again(store: Path):
    assert assert_right(store) == (0, "")


@pytest.mark.parametrize("seed", range(40))
def test_a_flipped_bit_is_found(store: Path, seed: int):
    choice = random.Random(seed)
    for path in results(store):
        content = bytearray(path.read_bytes())
        content[choice.randrange(len(content))] ^= 1 << choice.randrange(8)
        path.write_bytes(content)
    computed, said = assert_right(store)
    assert computed == len(TASKS)
    assert said.count("it is damaged, or the result of another task. Its result is computed") == 4
    assert assert_right(store) == (0, "")


def exchanged(paths: list[Path]) -> None:
    contents = [path.read_bytes() for path in paths]
    for path, content in zip(paths, [*contents[1:], contents[0]], strict=True):
        path.write_bytes(content)


def linked(paths: list[Path]) -> None:
    for path in paths:
        path.rename(path.parent.parent / path.name)
        path.symlink_to(path.parent.parent / path.name)


def pipes(paths: list[Path]) -> None:
    for path in paths:
        path.unlink()
        os.mkfifo(path)


def folders(paths: list[Path]) -> None:
    for path in paths:
        path.unlink()
        path.mkdir()


def written_by_all(paths: list[Path]) -> None:
    for path in paths:
        path.chmod(0o666)


def cut(part: float):
    def truncate(paths: list[Path]) -> None:
        for path in paths:
            os.truncate(path, int(part * path.stat().st_size))

    return truncate


def with_content(content: bytes):
    def write(paths: list[Path]) -> None:
        for path in paths:
            path.write_bytes(content)

    return write


DAMAGES = {
    "exchanged": (exchanged, "the result of another task"),
    "links": (linked, "it is a link"),
    "pipes": (pipes, "it is no regular file"),
    "folders": (folders, "it is no regular file"),
    "written by all": (written_by_all, "other users may write to it"),
    "empty": (cut(0.0), "it is damaged"),
    "half": (cut(0.5), "it is damaged"),
    "all but a byte": (cut(0.999), "it is damaged"),
    "longer": (with_content(b"x" * 100_000), "it is damaged"),
    "a pickle": (with_content(b"cos\nsystem\n(S'touch stolen'\ntR."), "it is damaged"),
}


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows has neither pipes nor modes")
@pytest.mark.parametrize("name", DAMAGES)
def test_what_is_not_the_result_of_a_task_is_computed_anew_and_said(store: Path, name: str):
    damage, reason = DAMAGES[name]
    paths = results(store)
    damage(paths)
    begin = time.monotonic()
    computed, said = assert_right(store)
    assert time.monotonic() - begin < 20.0
    assert computed == len(TASKS)
    for path in paths:
        assert f"{path} is not used: " in said
    assert said.count(reason) == len(paths)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="users have no number on Windows")
def test_the_results_of_another_user_are_not_used(store: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    computed, said = assert_right(store)
    assert computed == len(TASKS)
    assert f"{store} is not used: it belongs to another user" in said


def opened_to_all(folder: Path) -> None:
    folder.chmod(0o777)


def a_link(folder: Path) -> None:
    folder.rename(folder.with_name("elsewhere"))
    folder.symlink_to(folder.with_name("elsewhere"))


def a_file(folder: Path) -> None:
    folder.rename(folder.with_name("elsewhere"))
    folder.touch()


def a_pipe(folder: Path) -> None:
    folder.rename(folder.with_name("elsewhere"))
    os.mkfifo(folder)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="Windows has neither pipes nor modes")
@pytest.mark.parametrize("change", [opened_to_all, a_link, a_file, a_pipe])
def test_a_folder_to_which_others_may_write_is_not_used(store: Path, change):
    before = {path.name: path.stat().st_mtime_ns for path in results(store)}
    change(store)
    computed, said = assert_right(store)
    assert computed == len(TASKS)
    assert f"{store} is not used: " in said
    assert "Remove it to have results stored" in said
    elsewhere = store.with_name("elsewhere")
    kept = store if change is opened_to_all else elsewhere
    assert {path.name: path.stat().st_mtime_ns for path in results(kept)} == before


def test_a_full_disk_is_said_and_the_results_are_right(tmp_path: Path, monkeypatch):
    def full(*given):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    computed, said = assert_right(tmp_path / STORE_FOLDER)
    assert computed == len(TASKS)
    assert "results cannot be stored: No space left on device" in said
    assert results(tmp_path / STORE_FOLDER) == []


def test_what_a_killed_process_has_left_is_removed(store: Path):
    (store / ".abc.result.1-2.part").touch()
    assert_right(store)
    assert {path.suffix for path in store.iterdir()} == {".result"}


def test_removal_leaves_the_files_of_others(store: Path):
    (store / "notes.txt").touch()
    with result_store(store) as opened:
        opened.remove()
    assert [path.name for path in store.iterdir()] == ["notes.txt"]


# Commands


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_inputs(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stored results stay, as after an interruption just before the output is written."""
    monkeypatch.setattr("airmuscle.engine.result_store.ResultStore.remove", lambda self: None)


def computes_nothing(self: DistributedCalls, tasks) -> Iterator:
    assert not len(tasks), f"{self._function.__qualname__} is computed again"
    yield from ()


@pytest.mark.parametrize(
    "name",
    [name if name in FEW else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS],
)
def test_a_command_goes_on_from_its_results(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str
):
    """The second call computes no task, and says the same; the results are then removed."""
    command = (*COMMANDS[name], "--json", "--out", folder / "out", "--workers", 1)
    with monkeypatch.context() as patch:
        kept(patch)
        first = airmuscle(*command)
    assert first.exit_code == 0, first.stderr
    assert results(folder / "out" / STORE_FOLDER)
    assert "resuming" not in first.stderr
    monkeypatch.setattr(DistributedCalls, "_computed", computes_nothing)
    second = airmuscle(*command)
    assert second.exit_code == 0, second.stderr
    assert f"resuming from the results in {folder / 'out' / STORE_FOLDER}" in second.stderr
    assert second.stdout == first.stdout
    assert (folder / "out" / STORE_FOLDER).exists() == (name == "study")


def test_an_error_says_where_the_results_are(folder: Path, monkeypatch: pytest.MonkeyPatch):
    def interrupted(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr("airmuscle.design.study.chunk.StudyResult", interrupted)
    done = airmuscle("study", "study.toml", "--out", "out", "--workers", 1)
    assert done.exit_code == 130
    tasks = Path("out") / STORE_FOLDER
    assert f"3 results saved in {tasks}; the same command resumes from there" in done.stderr


@pytest.mark.slow
def test_kills_do_not_change_the_result(folder: Path):
    """A study that is killed at random times until it is complete."""
    text = (folder / "study.toml").read_text(encoding="utf-8")
    (folder / "study.toml").write_text(text.replace("12", "192"), encoding="utf-8")
    command = [sys.executable, "-m", "airmuscle", "study", "study.toml", "--workers", "1", "--out"]
    subprocess.run([*command, "whole"], check=True, capture_output=True)
    moments = random.Random(5)
    for _ in range(12):
        process = subprocess.Popen(
            [*command, "killed"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        before = len(results(folder / "killed" / STORE_FOLDER))
        end = time.monotonic() + 60
        while process.poll() is None and time.monotonic() < end:
            if len(results(folder / "killed" / STORE_FOLDER)) > before:
                break
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, 0.2))
        process.send_signal(signal.SIGKILL)
        process.wait()
    subprocess.run([*command, "killed"], check=True, capture_output=True)
    whole, killed = ((folder / n / "results.csv").read_bytes() for n in ("whole", "killed"))
    assert killed == whole
