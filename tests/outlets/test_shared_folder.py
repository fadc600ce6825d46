"""Processes that share only a folder compute each task once, to the bits of one process alone, also
if some are killed.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from command_line import airmuscle
from scenario_files import HELD_FILL as SCENARIO
from scenario_files import HELD_STUDY, MUSCLE_FILE, PRESSURE_LOOP

from airmuscle import load_data
from airmuscle.bench import write
from airmuscle.core import check_writable, exclusive_folders
from airmuscle.core.display import quantity_text
from airmuscle.design import shared_folder
from airmuscle.engine.processes import check_running
from airmuscle.errors import AirmuscleError, FileError, InputError
from airmuscle.units import display


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in (("muscle", MUSCLE_FILE), ("scenario", SCENARIO), ("study", HELD_STUDY)):
        (tmp_path / f"{name}.toml").write_text(content, encoding="utf-8")
    return tmp_path


def started(folder: Path, out: str) -> subprocess.Popen:
    options = ("--out", str(folder / out), "--join", str(folder / "shared"), "--workers", "1")
    command = [sys.executable, "-m", "airmuscle", "study", str(folder / "study.toml"), *options]
    return subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )


def shares(said: str) -> list[int]:
    return [int(count) for count in re.findall(r"(\d+) by \S+:\d+", said)]


def results(folder: Path) -> list[Path]:
    shared = folder / "shared"
    return sorted(shared.glob("*.result")) if shared.is_dir() else []


def test_two_processes_with_one_command_share_a_study(folder: Path):
    """Each chunk is computed once; the process that comes second to the output folder writes
    nothing there.
    """
    alone = airmuscle(
        "study", str(folder / "study.toml"), "--out", str(folder / "alone"), "--workers", "1"
    )
    assert alone.exit_code == 0
    both = [started(folder, "out") for _ in range(2)]
    said = [process.communicate(timeout=240)[1] for process in both]
    assert [process.returncode for process in both] == [0, 0], said
    assert [sum(shares(each)) for each in said] == [12, 12]
    assert len(results(folder)) == 12
    assert (folder / "out" / "results.csv").read_bytes() == (
        folder / "alone" / "results.csv"
    ).read_bytes()
    assert not list((folder / "shared").glob("*.claim*"))
    assert not (folder / "out" / "chunks").exists()  # the results are saved once
    assert "Tasks of the shared folder: " in (folder / "out" / "report.html").read_text(
        encoding="utf-8"
    )


def killed_at_random(folder: Path, kills: int) -> None:
    """Kill one of two processes `kills` times, at random moments, and compare the result with that
    of one process.
    """
    moments = random.Random(1)
    assert (
        airmuscle("study", str(folder / "study.toml"), "--out", str(folder / "alone")).exit_code
        == 0
    )
    for attempt in range(kills):
        shutil.rmtree(folder / "shared", ignore_errors=True)
        shutil.rmtree(folder / f"out{attempt}", ignore_errors=True)
        victim = started(folder, "victim")
        survivor = started(folder, f"out{attempt}")
        end = time.monotonic() + 60
        while not results(folder) and survivor.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        time.sleep(moments.uniform(0.0, 0.5))
        os.killpg(victim.pid, signal.SIGKILL)
        victim.communicate()
        _, said = survivor.communicate(timeout=120)
        assert survivor.returncode == 0, said
        assert sum(shares(said)) == 12
        whole = (folder / f"out{attempt}" / "results.csv").read_bytes()
        assert whole == (folder / "alone" / "results.csv").read_bytes()


@pytest.mark.slow
def test_thirty_kills_do_not_change_the_result(folder: Path):
    killed_at_random(folder, 30)


@pytest.fixture
def three_times_as_fast(monkeypatch: pytest.MonkeyPatch) -> float:
    """Claims are renewed and expire in a third of the time; the time of expiry [s] of the
    program.
    """
    distribution = importlib.import_module("airmuscle.engine.distribution")
    expiry = distribution.EXPIRY
    monkeypatch.setattr(distribution, "EXPIRY", expiry / 3)
    monkeypatch.setattr(distribution, "HEARTBEAT", distribution.HEARTBEAT / 3)
    return expiry


def test_the_claim_of_a_process_that_has_ended_is_taken_over_within_10_s(
    tmp_path: Path, three_times_as_fast: float
):
    with shared_folder(tmp_path, 1) as executor:
        executor.submit(math.factorial, 20).result()
    (result,) = tmp_path.glob("*.result")
    result.rename(tmp_path / f"{result.stem}.claim")  # the claim of nobody
    begin = time.monotonic()
    with shared_folder(tmp_path, 1) as executor:
        assert executor.submit(math.factorial, 20).result() == math.factorial(20)
    assert 5.0 / 3 < time.monotonic() - begin < 10.0 / 3 + 5.0  # the start of a worker included
    assert 5.0 < three_times_as_fast < 10.0


@pytest.mark.usefixtures("three_times_as_fast")
def test_a_renewed_claim_is_respected_and_its_result_read(tmp_path: Path):
    with shared_folder(tmp_path, 1) as executor:
        executor.submit(math.factorial, 20).result()
    (result,) = tmp_path.glob("*.result")
    kept = result.rename(tmp_path / "kept")
    claim = tmp_path / f"{result.stem}.claim"
    claim.touch()

    def other() -> None:
        for _ in range(24):  # twice as long as an unrenewed claim lasts
            time.sleep(0.5 / 3)
            claim.touch()
        kept.rename(result)
        claim.unlink()

    process = threading.Thread(target=other)
    begin = time.monotonic()
    process.start()
    with shared_folder(tmp_path, 1) as executor:
        assert executor.submit(math.factorial, 20).result() == math.factorial(20)
        (source,) = executor.contributions
    assert time.monotonic() - begin > 24 * 0.5 / 3, "the claim was taken over"
    process.join()
    assert source.rpartition(":")[2] == str(os.getpid())  # of the first executor, which computed it
    assert len(list(tmp_path.glob("*.result"))) == 1


def test_one_worker_is_the_process_itself_with_its_units_and_stops_between_two_runs(tmp_path: Path):
    with display("bar"), shared_folder(tmp_path, 1) as executor:
        assert executor.submit(os.getpid).result() == os.getpid()
        assert executor.submit(quantity_text, 3e5, "Pa", "kPa").result() == "3 bar"
    tasks = []

    def interrupted() -> None:
        with shared_folder(tmp_path, 1) as executor:
            tasks.append(executor.submit(_until_stopped))
            time.sleep(0.2)  # the task has begun
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert tasks[0].cancelled()


def _until_stopped() -> None:
    while True:
        time.sleep(0.01)
        check_running()


def test_a_damaged_result_is_computed_again_and_an_exception_is_raised_not_stored(tmp_path: Path):
    with shared_folder(tmp_path, 2) as executor:
        assert list(executor.map(math.factorial, range(5))) == [1, 1, 2, 6, 24]
        with pytest.raises(ValueError, match="factorial"):
            executor.submit(math.factorial, -1).result()
    stored = list(tmp_path.glob("*.result"))
    assert len(stored) == 5
    stored[0].write_bytes(stored[0].read_bytes()[:-3])
    with shared_folder(tmp_path, 1) as executor:
        assert list(executor.map(math.factorial, range(5))) == [1, 1, 2, 6, 24]


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="users have no number on Windows")
def test_the_result_of_another_user_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with shared_folder(tmp_path, 1) as executor:
        executor.submit(math.factorial, 5).result()
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    with (
        pytest.raises(FileError, match="belongs to another user"),
        shared_folder(tmp_path, 1) as executor,
    ):
        executor.submit(math.factorial, 5).result()


def test_a_comparison_of_laws_is_shared(tmp_path: Path):
    """The second process reads every score; both recommend what one process alone does."""
    data = write(load_data("dmsp-20-300"), tmp_path / "bench.csv")
    command = ("fit", str(data), "--compare", "--json", "--workers", "1")
    alone = airmuscle(*command, "--out", str(tmp_path / "alone"))
    joined = [
        airmuscle(*command, "--out", str(tmp_path / name), "--join", str(tmp_path / "s"))
        for name in ("a", "b")
    ]
    assert [each.exit_code for each in (alone, *joined)] == [0, 0, 0]
    expected, *found = ({**json.loads(each.stdout), "files": None} for each in (alone, *joined))
    assert found == [expected] * 2
    assert (
        shares(joined[0].stderr)
        == shares(joined[1].stderr)
        == [len(list((tmp_path / "s").glob("*.result")))]
    )


def test_options_that_exclude_each_other_are_refused(folder: Path):
    study = ("study", str(folder / "study.toml"), "--dask", "tcp://127.0.0.1:1")
    assert (
        "--join and --dask exclude each other"
        in airmuscle(*study, "--join", str(folder / "shared")).stderr
    )
    assert "--workers and --dask exclude each other" in airmuscle(*study, "--workers", "2").stderr
    single = airmuscle(
        "fit",
        str(folder / "x.csv"),
        "--characteristic",
        "Sarosi2012",
        "--join",
        str(folder / "shared"),
    )
    assert "distribute the candidates of --compare" in single.stderr


def test_a_tuning_is_shared_by_its_generations(folder: Path):
    """The second process reads all metrics and writes its own files; both have the gains of one
    process alone.
    """
    (folder / "loop.toml").write_text(PRESSURE_LOOP, encoding="utf-8")
    command = (
        "tune",
        str(folder / "loop.toml"),
        "--budget",
        "64",
        "--draws",
        "1",
        "--workers",
        "1",
    )
    assert airmuscle(*command, "--out", str(folder / "alone")).exit_code == 0
    join = ("--join", str(folder / "shared"))
    joined = [airmuscle(*command, "--out", str(folder / name), *join) for name in ("a", "b")]
    assert [each.exit_code for each in joined] == [0, 0], joined[0].stderr
    assert shares(joined[0].stderr) == shares(joined[1].stderr) == [len(results(folder))] == [2]
    alone, *both = ((folder / name / "history.csv").read_bytes() for name in ("alone", "a", "b"))
    assert both == [alone] * 2


def test_the_process_that_does_not_write_names_the_files_of_the_other(folder: Path):
    """Of two processes of a command one holds the folder of the output; the other draws no
    figure.
    """
    data = write(load_data("dmsp-20-300"), folder / "bench.csv")
    join = ("--join", str(folder / "shared"), "--workers", "1")
    commands = [
        (
            "fit",
            str(data),
            "--compare",
            "--characteristic",
            "Sarosi2012",
            *join,
            "--out",
            str(folder / "out"),
        ),
        ("study", str(folder / "study.toml"), "--json", *join, "--out", str(folder / "out")),
    ]
    with exclusive_folders():
        check_writable(folder / "out")
        fit, study = (airmuscle(*command) for command in commands)
    assert (fit.exit_code, study.exit_code) == (0, 0), fit.stderr
    for said in (fit, study):
        assert "out is written by another process; this one computes for" in said.stderr
    assert f"muscle: {folder / 'out' / 'muscle.toml'}" in fit.stdout
    assert json.loads(study.stdout)["files"]["report"] == str(folder / "out" / "report.html")
    assert not (folder / "out").exists()


def test_the_output_of_a_process_that_has_ended_is_written_by_the_other(
    folder: Path, monkeypatch: pytest.MonkeyPatch
):
    """At the start another process holds the folder of the output; at the end it is free, and
    without a report.
    """
    monkeypatch.setattr("airmuscle.outlets.cli.delivery.Execution.writes", lambda self, out: False)
    command = (
        "study",
        str(folder / "study.toml"),
        "--join",
        str(folder / "shared"),
        "--workers",
        "1",
    )
    done = airmuscle(*command, "--out", str(folder / "out"))
    assert done.exit_code == 0, done.stderr
    assert (folder / "out" / "report.html").is_file()
    assert (folder / "out" / "results.csv").is_file()


def test_a_shared_folder_stays_for_the_processes_that_start_at_once(tmp_path: Path):
    check_writable(tmp_path / "shared", shared=True)
    assert (tmp_path / "shared").is_dir()
    check_writable(tmp_path / "own")
    assert not (tmp_path / "own").exists()


def test_invalid_folders_and_numbers_of_workers_are_errors(tmp_path: Path):
    (tmp_path / "file").touch()
    with (
        pytest.raises(AirmuscleError, match="cannot be written to"),
        shared_folder(tmp_path / "file"),
    ):
        pass
    with pytest.raises(InputError, match="workers is 0"), shared_folder(tmp_path, 0):
        pass
