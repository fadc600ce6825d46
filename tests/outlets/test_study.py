"""Parameter studies: the results are bit-identical for every kind of execution.

Killed and resumed, in one process or several, in threads or on a Dask cluster: results.csv, the
chunk files and the figures are identical byte by byte. A chunk is computed again if and only if
something that it depends on has changed. A failed run is recorded with its reason and stops no
other run. An invalid study is rejected with one line that names the location.
"""

from __future__ import annotations

import contextlib
import csv
import ctypes
import dataclasses
import functools
import importlib
import multiprocessing
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from scenario_files import HELD_FILL as SCENARIO
from scenario_files import MUSCLE_FILE

from airmuscle.core import tree
from airmuscle.design import dask_cluster, load_study, process_pool, run_study
from airmuscle.design.study import DESIGNS, METRICS, VARIATIONS, chunk, write_study
from airmuscle.engine import simulate, solve
from airmuscle.errors import AirmuscleError, ColumnError, FileError, InputError, SimulationError
from airmuscle.files import load_scenario
from airmuscle.outlets.cli import check_interrupted, deferred_sigint
from airmuscle.report import save_table

ROOT = Path(__file__).parents[2]
STUDY = """
title = "Two valves"
scenario = "scenario.toml"
chunk_size = 4
[vary]
"circuit.fill.conductance" = { model = "Normal", mean = "3e-9 m3/(s Pa)", std = "0.2e-9 m3/(s Pa)" }
"mechanism.contraction" = { model = "Uniform", low = "2 %", high = "10 %" }
[design]
model = "MonteCarlo"
count = 22
seed = 3
[metrics]
pressure = { model = "Final", column = "pressure" }
reached = { model = "TimeToReach", column = "pressure", level = "2 bar", begin = "0.1 s" }
course = { model = "TimeSeries", column = "force", sample_time = "0.05 s" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in (("muscle", MUSCLE_FILE), ("scenario", SCENARIO), ("study", STUDY)):
        (tmp_path / f"{name}.toml").write_text(content, encoding="utf-8")
    return tmp_path


def edited(folder: Path, old: str, new: str, file: str = "study.toml") -> Path:
    content = (folder / file).read_text(encoding="utf-8")
    assert old in content
    (folder / file).write_text(content.replace(old, new), encoding="utf-8")
    return folder / "study.toml"


def run(folder: Path, out: str = "out", executor=None):
    """The result of the study; writes results.csv without the report, whose figures take most of
    the time.
    """
    result = run_study(load_study(folder / "study.toml"), folder / out, executor)
    save_table(result.table(), folder / out / "results.csv")
    return result


def contents(out: Path) -> dict[str, bytes]:
    """All files of a study except for the page, which contains the date."""
    return {
        p.relative_to(out).as_posix(): p.read_bytes()
        for p in out.rglob("*")
        if p.is_file() and p.suffix != ".html"
    }


def command(folder: Path, *options: str) -> list[str]:
    return [
        sys.executable,
        "-m",
        "airmuscle",
        "study",
        str(folder / "study.toml"),
        "--out",
        str(folder / "out"),
        *options,
    ]


HEARING = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run in the background
runpy.run_module("airmuscle", run_name="__main__", alter_sys=True)
"""


def started(folder: Path, chunks: int, *options: str) -> subprocess.Popen:
    """A running study that has saved at least `chunks` chunks; SIGINT reaches it as from a
    terminal.
    """
    process = subprocess.Popen(
        [sys.executable, "-c", HEARING, *command(folder, *options)[3:]],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + 120
    while len(list((folder / "out" / "tasks").glob("*.result"))) < chunks:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.01)
    return process


# Bit-identical results


@pytest.mark.drawn
@pytest.mark.slow
def test_a_killed_study_is_resumed_with_bit_identical_results(folder: Path):
    edited(folder, "count = 22", "count = 200")
    process = started(folder, 3, "--workers", "2")
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = {p: p.stat().st_mtime_ns for p in (folder / "out" / "tasks").glob("*.result")}
    assert 3 <= len(before) < 50
    (folder / "out" / "tasks" / ".00000.result.1234-5.part").write_bytes(b"half a chunk")
    done = subprocess.run(command(folder), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"resuming from the results in {folder / 'out' / 'tasks'}" in done.stderr
    assert {p: p.stat().st_mtime_ns for p in before} == before, "saved runs were computed again"
    write_study(run(folder, "uninterrupted"), folder / "uninterrupted")
    assert contents(folder / "out") == contents(folder / "uninterrupted")


def children_of(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def is_alive(pid: int) -> bool:
    """Whether a process exists and is not a zombie that waits for its parent."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def ignores_sigint(pid: int) -> bool:
    """Whether a worker has been initialised."""
    (mask,) = re.findall(r"SigIgn:\s*(\w+)", Path(f"/proc/{pid}/status").read_text())
    return bool(int(mask, 16) & 1 << signal.SIGINT - 1)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are observed in /proc")
def test_workers_exit_within_a_second_when_their_parent_is_killed(folder: Path):
    edited(folder, "count = 22", "count = 2000")
    process = started(folder, 3, "--workers", "2")
    end = time.monotonic() + 60
    while not (
        len(children := children_of(process.pid)) >= 3 and all(map(ignores_sigint, children))
    ):
        assert time.monotonic() < end, (
            "two workers and the resource tracker of multiprocessing are expected"
        )
        time.sleep(0.01)
    process.kill()
    process.wait()
    end = time.monotonic() + 1.0
    while any(map(is_alive, children)):
        assert time.monotonic() < end, "a worker survived its parent"
        time.sleep(0.01)


def test_only_a_resumed_study_is_reported_as_resumed(folder: Path):
    arguments = [
        "study",
        str(folder / "study.toml"),
        "--out",
        str(folder / "out"),
        "--workers",
        "1",
    ]
    first, second = (airmuscle(*arguments) for _ in range(2))
    assert "resuming" not in first.stderr
    assert f"resuming from the results in {folder / 'out' / 'tasks'}" in second.stderr
    assert second.stdout == first.stdout


@pytest.mark.parametrize("workers", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_ctrl_c_saves_completed_runs_and_says_how_to_resume(folder: Path, workers: str):
    edited(folder, "count = 22", "count = 2000")
    process = started(folder, 3, "--workers", workers)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "the same command resumes from there" in said
    assert "Traceback" not in said
    (kept,) = re.findall(r"(\d+) results saved in", said)
    assert int(kept) == len(list((folder / "out" / "tasks").glob("*.result")))
    assert not (folder / "out" / "results.csv").exists()


def test_ctrl_c_while_workers_start_gives_no_traceback():
    with process_pool(2) as executor:
        tasks = [executor.submit(os.getpid) for _ in range(2)]
        for _ in range(40):
            for child in multiprocessing.active_children():
                os.kill(child.pid, signal.SIGINT)
            time.sleep(0.01)
        assert len({task.result() for task in tasks}) in {1, 2}


def test_a_sigint_that_python_discards_is_not_lost(monkeypatch):
    lost = []
    monkeypatch.setattr(sys, "unraisablehook", lost.append)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)

    class Dying:
        def __del__(self):
            signal.raise_signal(signal.SIGINT)

    def working():
        with deferred_sigint():
            check_interrupted()
            thing = Dying()
            del thing
            assert [e.exc_type for e in lost] == [KeyboardInterrupt]
            with pytest.raises(KeyboardInterrupt):
                check_interrupted()

    def interrupted_import():
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        raise ImportError("initialization failed")

    try:
        with pytest.raises(KeyboardInterrupt):
            working()
        check_interrupted()  # forgotten once the block has raised it
        with pytest.raises(KeyboardInterrupt), deferred_sigint():
            interrupted_import()
        with (
            pytest.raises(KeyboardInterrupt),
            deferred_sigint(),
            deferred_sigint(),
        ):  # blocks may be nested
            interrupted_import()
        with pytest.raises(ImportError), deferred_sigint():
            raise ImportError
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


@contextlib.contextmanager
def threads():
    with ThreadPoolExecutor(3) as executor:
        yield executor


@contextlib.contextmanager
def local_dask():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            worker_dashboard_address=None,
        ) as cluster,
        dask_cluster(cluster.scheduler_address) as executor,
    ):
        yield executor


def test_each_worker_of_a_pool_has_one_thread_of_linear_algebra_and_its_share_of_the_cores(
    monkeypatch,
):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    environment = functools.partial(subprocess.check_output, shell=True, text=True)
    with process_pool(2, one_thread_each=True) as pool:
        said = set(pool.map(environment, ["sleep 0.3; echo $PPID has $OPENBLAS_NUM_THREADS"] * 8))
        cores = "__import__('sys').modules['airmuscle.engine.processes'].available_cores()"
        assert (
            pool.submit(eval, cores).result() == 1
        )  # of those of this process, which conftest limits to one
    assert [text.split()[1:] for text in said] == [["has", "1"]] * 2
    assert "OPENBLAS_NUM_THREADS" not in os.environ


def test_one_worker_is_the_process_itself_with_one_thread_of_linear_algebra(monkeypatch):
    """Two threads of the small matrices of `compare` take five times the CPU time on a busy
    machine.
    """
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    library = ctypes.CDLL(importlib.import_module("numpy.linalg._umath_linalg").__file__)
    threads, set_threads = (
        getattr(library, f"scipy_openblas_{verb}_num_threads64_", None) for verb in ("get", "set")
    )
    if threads is None:
        pytest.skip("NumPy has another library of linear algebra than OpenBLAS")
    before = threads()
    try:
        set_threads(2)
        with process_pool(1, one_thread_each=True) as pool:
            assert (pool, threads()) == (None, 1)
        assert threads() == 2
        monkeypatch.setenv("OMP_NUM_THREADS", "2")  # the user says otherwise
        with process_pool(1, one_thread_each=True):
            assert threads() == 2
    finally:
        set_threads(before)


@pytest.mark.parametrize(
    "place", [lambda: process_pool(3), threads, local_dask], ids=["processes", "threads", "dask"]
)
@pytest.mark.slow
def test_results_do_not_depend_on_the_executor(folder: Path, place):
    run(folder, "alone")
    with place() as executor:
        run(folder, "elsewhere", executor)
    assert contents(folder / "elsewhere") == contents(folder / "alone")


def test_the_result_does_not_depend_on_the_size_of_a_chunk(folder: Path):
    first = run(folder, "first")
    edited(folder, "chunk_size = 4", "chunk_size = 7")
    second = run(folder, "second")
    assert np.array_equal(first.scalars, second.scalars)
    assert np.array_equal(first["course"], second["course"])


def test_a_run_is_what_simulate_gives(folder: Path):
    result = run(folder)
    scenario = result.study.scenario(5)
    alone = simulate(
        scenario.plant,
        scenario.problem.input,
        duration=0.5,
        initial_state=scenario.initial_state,
        output_times=0.005,
    )
    assert result["pressure"][5] == pytest.approx(alone["pressure"][-1], rel=1e-12)
    assert result["course"][5] == pytest.approx(alone["force"][::10], rel=1e-9)
    assert scenario.plant.circuit.fill.conductance == result.study.values[5, 0]
    assert scenario.plant.mechanism.contraction == result.study.values[5, 1]


def test_initial_states_computed_together_equal_those_computed_individually(folder: Path):
    study = load_study(folder / "study.toml")
    states = study.template.initial_states(*study.varying(range(22)))
    assert [state == study.scenario(run).initial_state for run, state in enumerate(states)] == [
        True
    ] * 22
    assert study.scenario(3, states[3]).initial_state == states[3]
    assert len({state["air_mass"] for state in states}) == 22


def test_a_parameter_may_follow_any_varied_parameter(folder: Path):
    content = (folder / "study.toml").read_text(encoding="utf-8")
    follow = '[follow]\n"circuit.fill.critical_ratio" = "mechanism.contraction"\n[design]'
    (folder / "study.toml").write_text(content.replace("[design]", follow), encoding="utf-8")
    study = load_study(folder / "study.toml")
    assert study.scenario(5).plant.circuit.fill.critical_ratio == study.values[5, 1]


def test_a_varied_initial_state_is_computed_run_by_run(folder: Path):
    edited(
        folder,
        '"mechanism.contraction" =',
        '"run.initial_state.pressure" = { model = "Uniform", low = 0, high = 1e5 }\n"x" =',
    )
    text = (folder / "study.toml").read_text(encoding="utf-8")
    (folder / "study.toml").write_text(re.sub(r'"x" = .*\n', "", text), encoding="utf-8")
    study = load_study(folder / "study.toml")
    assert study.template.initial_states(*study.varying(range(4))) == [None] * 4
    assert len({study.scenario(run).initial_state["air_mass"] for run in range(4)}) == 4
    assert not run(folder).failed.size


# Chunks that are computed again


def computed_anew(folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The chunks that another execution of the study computes."""
    found = []
    original = chunk.compute_chunk
    monkeypatch.setattr(
        chunk, "compute_chunk", lambda study, index: found.append(index) or original(study, index)
    )
    run(folder)
    monkeypatch.undo()
    return found


EVERYTHING = list(range(6))


@pytest.mark.parametrize(
    ("old", "new", "file", "expected"),
    [
        ("Two valves", "Another title", "study.toml", []),
        ("seed = 3", "seed = 4", "study.toml", EVERYTHING),
        ("count = 22", "count = 26", "study.toml", [5, 6]),  # the last chunk was not full
        ('level = "2 bar"', 'level = "2.1 bar"', "study.toml", EVERYTHING),
        ("0.2e-9 m3/(s Pa)", "0.21e-9 m3/(s Pa)", "study.toml", EVERYTHING),
        ('"0.3 s"', '"0.31 s"', "scenario.toml", EVERYTHING),
        ('radius = "10 mm"', 'radius = "10.1 mm"', "muscle.toml", EVERYTHING),
    ],
)
def test_a_chunk_is_computed_again_if_something_it_depends_on_changes(
    folder, monkeypatch, old, new, file, expected
):
    run(folder)
    assert computed_anew(folder, monkeypatch) == []
    edited(folder, old, new, file)
    assert computed_anew(folder, monkeypatch) == expected


def test_another_program_version_computes_all_chunks_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
):
    run(folder)
    monkeypatch.setattr(tree.metadata, "version", lambda name: "another")
    tree.program_fingerprint.cache_clear()
    try:
        before = {p.stem for p in (folder / "out" / "tasks").glob("*.result")}
        assert len(before) == len(EVERYTHING)
        assert not before & set(chunk.chunk_keys(load_study(folder / "study.toml")))
    finally:
        tree.program_fingerprint.cache_clear()


def test_the_fingerprint_depends_on_how_the_initial_state_is_specified(folder: Path):
    """In equilibrium, or at a fixed position of equal value: the same nominal scenario, but not the
    same varied runs.
    """
    edited(
        folder,
        'model = "Isometric"\ncontraction = 0.05',
        'model = "HangingMass"\nmass = "5 kg"',
        "scenario.toml",
    )
    edited(
        folder,
        '"mechanism.contraction" = { model = "Uniform", low = "2 %", high = "10 %" }',
        '"mechanism.mass" = [4, 6]',
    )
    at_rest = load_study(folder / "study.toml")
    place = at_rest.template.scenario.initial_state["position"]
    edited(
        folder,
        'pressure = "0.5 bar"',
        f'pressure = "0.5 bar", position = {place!r}',
        "scenario.toml",
    )
    held = load_study(folder / "study.toml")
    assert held.template.scenario.initial_state == pytest.approx(
        at_rest.template.scenario.initial_state
    )
    assert held.scenario(0).initial_state != pytest.approx(at_rest.scenario(0).initial_state)
    assert held.fingerprint() != at_rest.fingerprint()


def test_the_fingerprint_of_a_model_depends_on_its_file_only_outside_the_program():
    """A moved file of the program changes no exported model; models of a user with one name are
    different models.
    """

    def made(module: str) -> str:
        kind = dataclasses.make_dataclass("Law", ["gain"])
        kind.__module__ = module
        return tree.fingerprint(kind(1.0))

    assert made("airmuscle.physics.old") == made("airmuscle.physics.moved") != made("laws.old")
    assert made("laws.old") != made("laws.moved")


def test_a_failure_reason_does_not_depend_on_the_path_of_the_study(
    folder: Path, monkeypatch: pytest.MonkeyPatch
):
    """A worker reads the study by its absolute path, and failure reasons are part of the
    results.
    """
    edited(folder, "[design]", '"run.duration" = ["0 s"]\n[design]')
    monkeypatch.chdir(folder)
    here, elsewhere = (
        chunk.compute_chunk(load_study(path), 0) for path in ("study.toml", folder / "study.toml")
    )
    assert list(here["failure_reasons"]) == list(elsewhere["failure_reasons"])
    assert here["failure_reasons"][0].startswith(
        "scenario.toml, [run], duration is 0.0; it must be greater than zero"
    )


def test_a_worker_ignores_sigint():
    with process_pool(2) as executor:
        assert executor.submit(signal.getsignal, signal.SIGINT).result() == signal.SIG_IGN


def test_a_worker_rejects_a_different_study(folder: Path):
    study = load_study(folder / "study.toml")
    with pytest.raises(FileError, match="a worker process has read a different study"):
        chunk.run_chunk((str(study.path), "0" * 64), 0)


def test_a_dead_worker_is_an_error_that_says_how_to_resume(folder: Path):
    study = load_study(edited(folder, "count = 22", "count = 2000"))
    with process_pool(2) as executor:

        def killing(done: int, of: int) -> None:
            if done:
                for process in executor._processes.values():
                    process.kill()

        with pytest.raises(SimulationError, match="a worker process died"):
            run_study(study, folder / "out", executor, killing)
    assert 1 <= len(list((folder / "out" / "tasks").glob("*.result"))) < 500


# Failed runs


def test_a_failed_run_is_recorded_with_its_reason_and_stops_no_other(folder: Path):
    edited(folder, "[design]", '"input.fill[0][1]" = [1, 2]\n[design]')
    result = run(folder)
    opened = result.study.values[:, 2] == 2
    assert 0 < opened.sum() < 22
    assert np.array_equal(result.failed, np.flatnonzero(opened))
    assert np.isnan(result.scalars[opened]).all()
    assert np.isfinite(result.scalars[~opened, 0]).all()
    rows = list(csv.DictReader((folder / "out" / "results.csv").open(encoding="utf-8")))
    assert [row["status"] for row in rows] == ["failed" if o else "done" for o in opened]
    assert all(
        "the input 'fill' is 2" in row["reason"] for row, o in zip(rows, opened, strict=True) if o
    )
    assert all(row["pressure [Pa]"] == "" for row, o in zip(rows, opened, strict=True) if o)


def test_a_value_outside_its_bounds_fails_only_its_own_run(folder: Path):
    edited(folder, 'std = "0.2e-9 m3/(s Pa)"', 'std = "3e-9 m3/(s Pa)"')
    result = run(folder)
    assert np.array_equal(result.failed, np.flatnonzero(result.study.values[:, 0] < 0))
    assert result.failed.size
    assert "allowed range: 0 to 1e-05" in result.failure_reasons[result.failed[0]]


def test_an_unexpected_exception_fails_only_its_own_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch
):
    calls = []

    def failing(*given, **named):
        calls.append(given)
        if len(calls) == 4:
            raise ZeroDivisionError("by nothing")
        return solve(*given, **named)

    monkeypatch.setattr("airmuscle.design.study.chunk.solve", failing)
    result = run(folder)
    assert [r for r in result.failure_reasons if r] == ["ZeroDivisionError: by nothing"]


def test_a_study_in_which_all_runs_fail_is_an_error(folder: Path):
    edited(folder, "[design]", '"input.fill[0][1]" = [2]\n[design]')
    done = airmuscle("study", folder / "study.toml", "--out", folder / "out", "--workers", "1")
    assert done.exit_code == 1
    assert "all 22 runs failed; reason of the first: " in done.stderr
    assert (folder / "out" / "results.csv").exists()


# Varied parameters


def test_parameters_of_command_and_run_may_vary(folder: Path):
    edited(
        folder,
        "[design]",
        '"input.fill[1][0]" = { model = "Range", low = "200 ms", high = "0.4 s", count = 3 }\n'
        '"run.initial_state.pressure" = ["0 bar", "1 bar"]\n"run.duration" = ["0.5 s"]\n[design]',
    )
    study = load_study(folder / "study.toml")
    scenario = study.scenario(0)
    closing, pressure, duration = study.values[0, 2:]
    assert scenario.problem.input.changes["fill"][1][0] == closing
    assert closing in (0.2, 0.30000000000000004, 0.4)
    assert scenario.initial_state == pytest.approx(scenario.plant.state_at(pressure=pressure))
    assert scenario.problem.duration == duration == 0.5


def test_a_parameter_follows_another(folder: Path):
    edited(
        folder,
        "[design]",
        '[follow]\n"circuit.discharge.conductance" = "circuit.fill.conductance"\n[design]',
    )
    circuit = load_study(folder / "study.toml").scenario(7).plant.circuit
    assert circuit.discharge.conductance == circuit.fill.conductance != 3e-9


def test_the_scenario_may_be_part_of_the_study_file(folder: Path):
    separate = run(folder, "separate")
    inside = (
        SCENARIO.replace("[plant", "[scenario.plant")
        .replace("[input", "[scenario.input")
        .replace("[run", "[scenario.run")
    )
    edited(folder, 'scenario = "scenario.toml"\n', "")
    edited(folder, "[vary]", f"{inside}\n[vary]")
    assert np.array_equal(run(folder, "inside").scalars, separate.scalars)


def test_the_example_runs(tmp_path: Path):
    for name in ("valve_study.toml", "fill_discharge.toml"):
        shutil.copy(ROOT / "examples" / name, tmp_path)
    study = load_study(tmp_path / "valve_study.toml")
    assert len(study) == 384
    assert (
        study.template.scenario.plant
        == load_scenario(ROOT / "examples" / "fill_discharge.toml").plant
    )
    (tmp_path / "valve_study.toml").rename(tmp_path / "study.toml")
    edited(tmp_path, "count = 64", "count = 2")
    result = run(tmp_path)
    assert result.failed.size == 0
    assert np.isfinite(result.scalars).all()


def test_the_study_in_the_documentation_is_valid(tmp_path: Path):
    page = (ROOT / "docs" / "guides/study.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    shutil.copy(ROOT / "examples" / "fill_discharge.toml", tmp_path)
    (tmp_path / "study.toml").write_text(blocks[0], encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    shown = set(re.findall(r"`(\w+)`", page))
    kinds = {*DESIGNS, *VARIATIONS, *METRICS}
    assert kinds <= shown, f"the page lacks {kinds - shown}"
    assert len(study) == 256


# Output files


def test_the_table_has_one_row_per_run_with_units(folder: Path):
    result = run(folder)
    rows = list(csv.DictReader((folder / "out" / "results.csv").open(encoding="utf-8")))
    assert list(rows[0]) == [
        "run",
        "circuit.fill.conductance [m3/(s Pa)]",
        "mechanism.contraction [1]",
        "pressure [Pa]",
        "reached [s]",
        "status",
        "reason",
    ]
    assert [float(row["pressure [Pa]"]) for row in rows] == result["pressure"].tolist()
    write_study(result, folder / "out")
    kept = np.load(folder / "out" / "time_series.npz")
    assert np.array_equal(kept["course"], result["course"])
    assert kept["course_time"] == pytest.approx(np.arange(11) * 0.05)


def test_an_unknown_metric_is_an_error_with_the_nearest_name(folder: Path):
    result = run(folder)
    with pytest.raises(
        ColumnError,
        match=r"no metric 'presure'; the metrics are pressure, reached, course.* 'pressure'",
    ):
        result["presure"]


def test_the_report_shows_design_statistics_and_figures(folder: Path):
    edited(folder, 'model = "MonteCarlo"\ncount = 22', 'model = "Saltelli"\ncount = 8')
    result = run(folder)
    chapter = result.chapter()
    assert [t.name for t in chapter.tables] == ["statistics", "sensitivities", "varied"]
    assert [p.name for p in chapter.plots] == [
        "histograms",
        "scatter-pressure",
        "scatter-reached",
        "sensitivities",
        "time-series-course",
    ]
    (scatter,) = chapter.plots[1].draw().axes[0].lines
    assert scatter.get_markersize() >= 5.0, "few points are drawn large"
    assert all(tick == round(tick) for tick in chapter.plots[0].draw().axes[0].get_yticks())
    statistics = result.statistics().columns
    assert statistics["mean"][0] == pytest.approx(result["pressure"].mean())
    assert statistics["median"][1] == pytest.approx(np.median(result["reached"]))
    own = load_study(folder / "study.toml").template.scenario.simulate()["pressure"][-1]
    assert statistics["nominal"][0] == pytest.approx(own, rel=1e-9)
    write_study(result, folder / "out")
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "Saltelli(count=8, seed=3)" in page
    assert "Variance-based sensitivities (Sobol indices)" in str(pickle.loads(pickle.dumps(result)))
    assert "<img" in result._repr_html_()


def test_the_command_names_its_report_last(folder: Path):
    out = str(folder / "out")
    done = airmuscle("study", folder / "study.toml", "--out", out, "--workers", "1")
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1] == f"report: {out}/report.html"
    assert "22 runs, MonteCarlo(count=22, seed=3)." in done.stdout


# Invalid studies

BAD = [
    (
        "circuit.fill.conductance",
        "circuit.fil.conductance",
        "Did you mean 'circuit.fill.conductance'?",
    ),
    ("mechanism.contraction", "run.stop", "the scenario has no parameter 'run.stop'"),
    ('low = "2 %"', "low = nan", "it must be finite"),
    ('low = "2 %"', "low = -inf", "it must be finite"),
    ('low = "2 %"', 'low = "2 mm"', "cannot be converted to a ratio"),
    ('low = "2 %"', 'low = "20 %"', "low is 0.2 and high is 0.1; low must be below high"),
    ('low = "2 %"', 'low = "-95 %"', "allowed range: "),
    ('low = "2 %", ', "", "Uniform needs 'low' (lower bound)"),
    (
        'low = "2 %"',
        'lo = "2 %"',
        "Uniform has no parameter 'lo'; its parameters are low, high. Did you mean 'low'?",
    ),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', "[]", "the list is empty"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', "[0.02, nan]", "it must be finite"),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        "0.02",
        "write a list of values, or a distribution",
    ),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        "[0.02, 0.99]",
        "includes 0.99; allowed range: ",
    ),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        '{ model = "Range", low = 0.0, high = 0.1, count = 0 }',
        "2 to 1000000 values",
    ),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        (
            '{ model = "Truncated", inner = { model = "Normal", mean = 0.05, std = 0.001 }, low ='
            " 0.1, high = 0.2 }"
        ),
        "it must be at least 1e-06",
    ),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        '{ model = "Truncated", inner = { model = "Truncated" }, low = 0.1, high = 0.2 }',
        "no model 'Truncated'; there are Uniform, Normal, LogNormal, Triangular.",
    ),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        '{ model = "Triangular", low = 0.0, mode = 0.3, high = 0.2 }',
        "mode is 0.3; allowed range: 0 to 0.2",
    ),
    (
        '{ model = "Uniform", low = "2 %", high = "10 %" }',
        '{ model = "LogNormal", median = 0.0, log_std = 0.1 }',
        "median is 0; it must be positive",
    ),
    (
        'model = "Uniform"',
        'model = "Unifrom"',
        (
            "no model 'Unifrom'; there are Range, Uniform, Normal, LogNormal, Triangular,"
            " Truncated. Did you mean 'Uniform'?"
        ),
    ),
    ('std = "0.2e-9 m3/(s Pa)"', "std = 0", "std is 0; it must be positive"),
    ('std = "0.2e-9 m3/(s Pa)"', 'std = "1 kg"', "cannot be converted to 'm3/(s Pa)'"),
    ("count = 22", "count = 0", "count is 0; it must be at least 1"),
    ("count = 22", "count = -1", "must be a non-negative integer"),
    ("count = 22", "count = 2.5", "must be a non-negative integer"),
    ("count = 22", "count = true", "must be a non-negative integer"),
    ("count = 22", "count = 100_000_000", "the maximum is 10000000"),
    ("count = 22\n", "", "MonteCarlo needs 'count'"),
    ("seed = 3", "seed = -3", "must be a non-negative integer"),
    (
        'model = "MonteCarlo"',
        'model = "Sobol"',
        (
            "count is 22; Sobol points are balanced only if their number is a power of two. Use 16"
            " or 32."
        ),
    ),
    ('model = "MonteCarlo"', 'model = "Saltelli"', "Use 16 or 32."),
    (
        'model = "MonteCarlo"\ncount = 22\nseed = 3',
        'model = "Grid"',
        "has no levels; give a list or a Range",
    ),
    (
        'model = "MonteCarlo"',
        'model = "Random"',
        "no model 'Random'; there are Grid, LatinHypercube",
    ),
    (
        '[design]\nmodel = "MonteCarlo"\ncount = 22\nseed = 3',
        "",
        '[design] is missing; it must contain an entry, such as model = "Grid".',
    ),
    ('"2 bar"', '"2 mm"', "cannot be converted to 'Pa'"),
    ('"2 bar"', "inf", "it must be finite"),
    (
        'model = "Final", column = "pressure"',
        'model = "Final", column = "presure"',
        "a run has no column 'presure'",
    ),
    (
        'model = "Final", column = "pressure"',
        'model = "Last", column = "pressure"',
        "no model 'Last'; there are Final, Maximum",
    ),
    ('begin = "0.1 s"', 'begin = "0.1 s", end = "0.1 s"', "its end must be later than its begin"),
    (
        'begin = "0.1 s"',
        'begin = "-9 s", end = "-8 s"',
        "the window -9 to -8 s does not overlap the run, 0 to",
    ),
    ('begin = "0.1 s"', 'begin = "9 s"', "does not overlap the run"),
    ('sample_time = "0.05 s"', 'sample_time = "0 s"', "it must be positive and finite"),
    ('sample_time = "0.05 s"', 'sample_time = "1 ns"', "2 to 1000000 samples"),
    ('sample_time = "0.05 s"', 'sample_time = "0.05 s", begin = "9 s"', "does not overlap the run"),
    ("chunk_size = 4", "chunk_size = 0", "chunk_size is 0; it must be at least 1"),
    ('scenario = "scenario.toml"', 'scenario = "senario.toml"', "there is no such file"),
    ('scenario = "scenario.toml"', "scenario = 5", "name a file"),
    ('scenario = "scenario.toml"', "", "scenario is None; name a file"),
    ("title", "titel", "unknown key 'titel'"),
    (
        "[design]",
        '[follow]\n"circuit.discharge.conductance" = "mechanism.contraction"\n[design]',
        "cannot follow",
    ),
    (
        "[design]",
        '[follow]\n"circuit.discharge.conductance" = "mechanism.contract"\n[design]',
        "is not under [vary]. Did you mean 'mechanism.contraction'?",
    ),
    (
        "[design]",
        '[follow]\n"mechanism.contraction" = "mechanism.contraction"\n[design]',
        "is also under [vary]",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_an_invalid_study_is_rejected(folder: Path, old: str, new: str, message: str):
    with pytest.raises(AirmuscleError) as refused:
        load_study(edited(folder, old, new))
    assert message in str(refused.value)
    assert "toml" in str(refused.value)


@pytest.mark.parametrize("table", ["vary", "metrics"])
def test_an_empty_or_missing_table_is_rejected(folder: Path, table: str):
    whole = (folder / "study.toml").read_text(encoding="utf-8")
    start = whole.index(f"[{table}]")
    end = whole.find("[design]") if table == "vary" else len(whole)
    for instead in ("", f"[{table}]\n"):
        (folder / "study.toml").write_text(whole[:start] + instead + whole[end:], encoding="utf-8")
        with pytest.raises(InputError, match=rf"\[{table}\] is (missing|empty)"):
            load_study(folder / "study.toml")


def test_invalid_executors_and_folders_are_rejected(folder: Path):
    with pytest.raises(InputError, match="workers is 0; it must be at least 1"), process_pool(0):
        pass
    (folder / "file").write_text("", encoding="utf-8")
    with pytest.raises(FileError, match="cannot be written to"):
        run_study(load_study(folder / "study.toml"), folder / "file")
    study = str(folder / "study.toml")
    both = airmuscle("study", study, "--workers", "2", "--cluster", "tcp://localhost:1")
    assert both.exit_code == 2
    assert "--workers and --cluster exclude each other" in both.stderr


def test_a_cluster_that_does_not_respond_is_rejected(monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("airmuscle.engine.cluster.CONNECT_TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://here"):
        with (
            pytest.raises(InputError, match=f"no response from a Dask scheduler at '{address}'"),
            dask_cluster(address),
        ):
            pass


def test_without_dask_a_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match=r"pip install .airmuscle\[cluster\]"),
        dask_cluster("tcp://127.0.0.1:8786"),
    ):
        pass
