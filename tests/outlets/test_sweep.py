"""A study gives the same results to the last bit however it was run.

Killed and resumed, in one process or several, in threads or on a Dask cluster: results.csv, the kept chunks and the
figures are equal byte by byte. A chunk is computed anew exactly when something that it depends on has changed. A run
that fails leaves its reason and stops no other. Every study that cannot be is refused in one line that says where.
"""

from __future__ import annotations

import contextlib
import csv
import multiprocessing
import os
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
from typer.testing import CliRunner

from airmuscle.cli.app import app
from airmuscle.cli.interruption import check_interrupted, deferred_sigint
from airmuscle.core.errors import AirmuscleError, FileError, InputError, SimulationError
from airmuscle.report.write import save_table
from airmuscle.scenario.scenario import load_scenario
from airmuscle.simulation.simulate import simulate
from airmuscle.study import chunk, dask_cluster, fingerprint, load_study, processes, run_study
from airmuscle.study.chapter import study_chapter, write_study
from airmuscle.study.design import DESIGNS
from airmuscle.study.distributions import DISTRIBUTIONS, Range
from airmuscle.study.metrics import OUTCOMES

ROOT = Path(__file__).parents[2]
MUSCLE = """
title = "A braid"
provenance = "example"
[characteristic]
model = "ChouHannaford1996"
geometry = { model = "Braid", radius = "10 mm", braid_angle = "25 deg", resting_length = "300 mm" }
[geometry]
model = "Braid"
radius = "10 mm"
braid_angle = "25 deg"
resting_length = "300 mm"
"""
SCENARIO = """
[plant]
muscle = "muscle.toml"
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "5 bar" }
fill = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
discharge = { model = "Valve", conductance = 3e-9, critical_ratio = 0.3 }
[plant.mechanism]
model = "Isometric"
contraction = 0.05
[command]
fill = [["0.1 s", 1], ["0.3 s", 0]]
[run]
duration = "0.5 s"
output = "5 ms"
start = { pressure = "0.5 bar" }
"""
STUDY = """
title = "Two valves"
scenario = "scenario.toml"
chunk = 4
[vary]
"circuit.fill.conductance" = { model = "Normal", mean = "3e-9 m3/(s Pa)", deviation = "0.2e-9 m3/(s Pa)" }
"mechanism.contraction" = { model = "Uniform", low = "2 %", high = "10 %" }
[design]
model = "MonteCarlo"
count = 22
seed = 3
[outcome]
pressure = { model = "Final", column = "pressure" }
reached = { model = "TimeToReach", column = "pressure", level = "2 bar", begin = "0.1 s" }
course = { model = "TimeSeries", column = "force", every = "0.05 s" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, content in (("muscle", MUSCLE), ("scenario", SCENARIO), ("study", STUDY)):
        (tmp_path / f"{name}.toml").write_text(content, encoding="utf-8")
    return tmp_path


def edited(folder: Path, old: str, new: str, file: str = "study.toml") -> Path:
    content = (folder / file).read_text(encoding="utf-8")
    assert old in content
    (folder / file).write_text(content.replace(old, new), encoding="utf-8")
    return folder / "study.toml"


def run(folder: Path, out: str = "out", executor=None):
    """The study's result, and results.csv; figures take longer than all the rest."""
    result = run_study(load_study(folder / "study.toml"), folder / out, executor)
    save_table(result.table(), folder / out / "results.csv")
    return result


def contents(out: Path) -> dict[str, bytes]:
    """Everything that a study writes, but the page, which carries the date."""
    return {
        p.relative_to(out).as_posix(): p.read_bytes() for p in out.rglob("*") if p.is_file() and p.suffix != ".html"
    }


def command(folder: Path, *options: str) -> list[str]:
    return [
        sys.executable,
        "-m",
        "airmuscle",
        "sweep",
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
    """A study that has kept as many chunks and is still running; Ctrl-C reaches it as it does from a terminal."""
    process = subprocess.Popen(
        [sys.executable, "-c", HEARING, *command(folder, *options)[3:]],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + 120
    while len(list((folder / "out" / "chunks").glob("*.npz"))) < chunks:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.002)
    return process


# The same to the last bit


def test_a_study_that_was_killed_goes_on_and_ends_bit_equal(folder: Path):
    edited(folder, "count = 22", "count = 400")
    process = started(folder, 3, "--workers", "2")
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = {p: p.stat().st_mtime_ns for p in (folder / "out" / "chunks").glob("*.npz")}
    assert 3 <= len(before) < 100
    (folder / "out" / "chunks" / ".unfinished-1234").write_bytes(b"half a chunk")
    done = subprocess.run(command(folder), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert {p: p.stat().st_mtime_ns for p in before} == before, "what was kept was computed again"
    write_study(run(folder, "uninterrupted"), folder / "uninterrupted")
    assert contents(folder / "out") == contents(folder / "uninterrupted")


@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(folder: Path, workers: str):
    edited(folder, "count = 22", "count = 2000")
    process = started(folder, 3, "--workers", workers)
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "of 2000 runs are saved in" in said
    assert "the same command resumes from there" in said
    assert "Traceback" not in said
    (kept,) = re.findall(r"(\d+) of 2000 runs are saved", said)
    assert int(kept) == 4 * len(list((folder / "out" / "chunks").glob("*.npz")))
    assert not (folder / "out" / "results.csv").exists()


def test_ctrl_c_while_workers_begin_is_no_traceback_of_theirs():
    with processes(2) as executor:
        tasks = [executor.submit(os.getpid) for _ in range(2)]
        for _ in range(40):
            for child in multiprocessing.active_children():
                os.kill(child.pid, signal.SIGINT)
            time.sleep(0.01)
        assert len({task.result() for task in tasks}) in {1, 2}


def test_ctrl_c_that_python_loses_is_remembered(monkeypatch):
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
        with pytest.raises(KeyboardInterrupt), deferred_sigint(), deferred_sigint():  # blocks may be nested
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
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, worker_dashboard_address=None
        ) as cluster,
        dask_cluster(cluster.scheduler_address) as executor,
    ):
        yield executor


@pytest.mark.parametrize("place", [lambda: processes(3), threads, local_dask], ids=["processes", "threads", "dask"])
def test_results_do_not_depend_on_the_executor(folder: Path, place):
    run(folder, "alone")
    with place() as executor:
        run(folder, "elsewhere", executor)
    assert contents(folder / "elsewhere") == contents(folder / "alone")


def test_the_result_does_not_depend_on_the_size_of_a_chunk(folder: Path):
    first = run(folder, "first")
    edited(folder, "chunk = 4", "chunk = 7")
    second = run(folder, "second")
    assert np.array_equal(first.numbers, second.numbers)
    assert np.array_equal(first["course"], second["course"])


def test_a_run_is_what_simulate_gives(folder: Path):
    result = run(folder)
    scenario = result.study.scenario(5)
    alone = simulate(scenario.plant, scenario.command, duration=0.5, start=scenario.start, output=0.005)
    assert result["pressure"][5] == pytest.approx(alone["pressure"][-1], rel=1e-12)
    assert result["course"][5] == pytest.approx(alone["force"][::10], rel=1e-9)
    assert scenario.plant.circuit.fill.conductance == result.study.values[5, 0]
    assert scenario.plant.mechanism.contraction == result.study.values[5, 1]


def test_where_the_runs_of_a_chunk_begin_is_found_at_once_and_is_what_each_finds_alone(folder: Path):
    study = load_study(folder / "study.toml")
    rests = study.rests(range(22))
    assert [rest == study.scenario(run).start for run, rest in enumerate(rests)] == [True] * 22
    assert study.scenario(3, rests[3]).start == rests[3]
    assert len({rest["air_mass"] for rest in rests}) == 22


def test_a_number_may_follow_any_that_varies(folder: Path):
    content = (folder / "study.toml").read_text(encoding="utf-8")
    follow = '[follow]\n"circuit.fill.critical_ratio" = "mechanism.contraction"\n[design]'
    (folder / "study.toml").write_text(content.replace("[design]", follow), encoding="utf-8")
    study = load_study(folder / "study.toml")
    assert study.scenario(5).plant.circuit.fill.critical_ratio == study.values[5, 1]


def test_a_start_that_varies_or_is_no_rest_is_found_run_by_run(folder: Path):
    edited(
        folder, '"mechanism.contraction" =', '"run.start.pressure" = { model = "Uniform", low = 0, high = 1e5 }\n"x" ='
    )
    text = (folder / "study.toml").read_text(encoding="utf-8")
    (folder / "study.toml").write_text(re.sub(r'"x" = .*\n', "", text), encoding="utf-8")
    study = load_study(folder / "study.toml")
    assert study.rests(range(4)) == [None] * 4
    assert len({study.scenario(run).start["air_mass"] for run in range(4)}) == 4
    assert not run(folder).failed.size


# What is computed anew


def computed_anew(folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The chunks that a further run of the study computes."""
    found = []
    original = chunk.computed
    monkeypatch.setattr(chunk, "computed", lambda study, index: found.append(index) or original(study, index))
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
def test_a_chunk_is_computed_anew_when_what_it_depends_on_changes(folder, monkeypatch, old, new, file, expected):
    run(folder)
    assert computed_anew(folder, monkeypatch) == []
    edited(folder, old, new, file)
    assert computed_anew(folder, monkeypatch) == expected


def test_another_program_computes_everything_anew(folder: Path, monkeypatch: pytest.MonkeyPatch):
    run(folder)
    monkeypatch.setattr(fingerprint.metadata, "version", lambda name: "another")
    fingerprint.program.cache_clear()
    try:
        assert not {p.name for p in (folder / "out" / "chunks").glob("*.npz")} & {
            chunk.name_of(load_study(folder / "study.toml"), i) for i in EVERYTHING
        }
    finally:
        fingerprint.program.cache_clear()


def test_a_chunk_that_is_damaged_is_computed_anew(folder: Path, monkeypatch: pytest.MonkeyPatch):
    result = run(folder)
    file = folder / "out" / "chunks" / chunk.name_of(result.study, 2)
    whole = file.read_bytes()
    for damaged in (whole[:-40], b"", whole[:200] + bytes(8) + whole[208:]):
        file.write_bytes(damaged)
        assert computed_anew(folder, monkeypatch) == [2]
        assert file.read_bytes() == whole


def test_a_chunk_appears_whole_or_not_at_all(folder: Path, monkeypatch: pytest.MonkeyPatch):
    study = load_study(folder / "study.toml")

    def refusing(*given):
        raise OSError(28, "no space left")

    monkeypatch.setattr(chunk.os, "replace", refusing)
    with pytest.raises(OSError, match="no space left"):
        chunk.write(chunk.computed(study, 0), folder / "chunk.npz")
    assert not {p.name for p in folder.iterdir()} - {"muscle.toml", "scenario.toml", "study.toml"}


def test_the_way_in_which_a_start_is_given_is_an_input_too(folder: Path):
    """At rest, or held where it happens to rest: equal for the scenario itself, but not for what varies."""
    edited(folder, 'model = "Isometric"\ncontraction = 0.05', 'model = "HangingMass"\nmass = "5 kg"', "scenario.toml")
    edited(
        folder,
        '"mechanism.contraction" = { model = "Uniform", low = "2 %", high = "10 %" }',
        '"mechanism.mass" = [4, 6]',
    )
    at_rest = load_study(folder / "study.toml")
    place = at_rest.source.scenario.start["position"]
    edited(folder, 'pressure = "0.5 bar"', f'pressure = "0.5 bar", position = {place!r}', "scenario.toml")
    held = load_study(folder / "study.toml")
    assert held.source.scenario.start == pytest.approx(at_rest.source.scenario.start)
    assert held.scenario(0).start != pytest.approx(at_rest.scenario(0).start)
    assert held.fingerprint() != at_rest.fingerprint()


def test_a_reason_is_the_same_from_wherever_the_study_was_read(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """A worker knows the study by its whole path, and reasons are results."""
    edited(folder, "[design]", '"run.duration" = ["0 s"]\n[design]')
    monkeypatch.chdir(folder)
    here, elsewhere = (chunk.computed(load_study(path), 0) for path in ("study.toml", folder / "study.toml"))
    assert list(here.reasons) == list(elsewhere.reasons)
    assert here.reasons[0].startswith("scenario.toml, [run], duration is 0.0; it must be greater than zero")


def test_a_worker_leaves_ctrl_c_to_the_process_that_it_works_for():
    with processes(2) as executor:
        assert executor.submit(signal.getsignal, signal.SIGINT).result() == signal.SIG_IGN


def test_a_worker_that_reads_another_study_refuses(folder: Path):
    study = load_study(folder / "study.toml")
    with pytest.raises(FileError, match="a worker reads another study than the one that was started"):
        chunk.run_chunk(str(study.path), "0" * 64, 0)


def test_a_worker_that_dies_is_an_error_that_says_how_to_go_on(folder: Path):
    study = load_study(edited(folder, "count = 22", "count = 2000"))
    with processes(2) as executor:

        def killing(done: int, of: int) -> None:
            if done:
                for process in executor._processes.values():
                    process.kill()

        with pytest.raises(SimulationError, match="a worker died"):
            run_study(study, folder / "out", executor, killing)
    assert 1 <= len(list((folder / "out" / "chunks").glob("*.npz"))) < 500


# Runs that fail


def test_a_run_that_fails_leaves_its_reason_and_stops_no_other(folder: Path):
    edited(folder, "[design]", '"command.fill[0][1]" = [1, 2]\n[design]')
    result = run(folder)
    opened = result.study.values[:, 2] == 2
    assert 0 < opened.sum() < 22
    assert np.array_equal(result.failed, np.flatnonzero(opened))
    assert np.isnan(result.numbers[opened]).all()
    assert np.isfinite(result.numbers[~opened, 0]).all()
    rows = list(csv.DictReader((folder / "out" / "results.csv").open(encoding="utf-8")))
    assert [row["status"] for row in rows] == ["failed" if o else "done" for o in opened]
    assert all("the input 'fill' is 2" in row["reason"] for row, o in zip(rows, opened, strict=True) if o)
    assert all(row["pressure [Pa]"] == "" for row, o in zip(rows, opened, strict=True) if o)


def test_a_value_beyond_its_bounds_fails_its_run_alone(folder: Path):
    edited(folder, 'deviation = "0.2e-9 m3/(s Pa)"', 'deviation = "3e-9 m3/(s Pa)"')
    result = run(folder)
    assert np.array_equal(result.failed, np.flatnonzero(result.study.values[:, 0] < 0))
    assert result.failed.size
    assert "allowed are" in result.reasons[result.failed[0]]


def test_what_nobody_foresaw_fails_its_run_alone(folder: Path, monkeypatch: pytest.MonkeyPatch):
    calls = []

    def failing(*given, **named):
        calls.append(given)
        if len(calls) == 4:
            raise ZeroDivisionError("by nothing")
        return simulate(*given, **named)

    monkeypatch.setattr("airmuscle.study.runs.simulate", failing)
    result = run(folder)
    assert [r for r in result.reasons if r] == ["ZeroDivisionError: by nothing"]


def test_a_study_of_failures_alone_says_so(folder: Path):
    edited(folder, "[design]", '"command.fill[0][1]" = [2]\n[design]')
    done = CliRunner().invoke(
        app, ["sweep", str(folder / "study.toml"), "--out", str(folder / "out"), "--workers", "1"]
    )
    assert done.exit_code == 1
    assert "all 22 runs failed; reason of the first: " in done.stderr
    assert (folder / "out" / "results.csv").exists()


# What varies


def test_numbers_of_command_and_run_vary_too(folder: Path):
    edited(
        folder,
        "[design]",
        '"command.fill[1][0]" = { model = "Range", low = "200 ms", high = "0.4 s", count = 3 }\n'
        '"run.start.pressure" = ["0 bar", "1 bar"]\n"run.duration" = ["0.5 s"]\n[design]',
    )
    study = load_study(folder / "study.toml")
    scenario = study.scenario(0)
    closing, pressure, duration = study.values[0, 2:]
    assert scenario.command.changes["fill"][1][0] == closing
    assert closing in (0.2, 0.30000000000000004, 0.4)
    assert scenario.start == pytest.approx(scenario.plant.state_at(pressure=pressure))
    assert scenario.duration == duration == 0.5


def test_a_number_follows_another(folder: Path):
    edited(folder, "[design]", '[follow]\n"circuit.discharge.conductance" = "circuit.fill.conductance"\n[design]')
    circuit = load_study(folder / "study.toml").scenario(7).plant.circuit
    assert circuit.discharge.conductance == circuit.fill.conductance != 3e-9


def test_a_scenario_may_stand_in_the_study(folder: Path):
    beside = run(folder, "beside")
    inside = (
        SCENARIO.replace("[plant", "[scenario.plant")
        .replace("[command", "[scenario.command")
        .replace("[run", "[scenario.run")
    )
    edited(folder, 'scenario = "scenario.toml"\n', "")
    edited(folder, "[vary]", f"{inside}\n[vary]")
    assert np.array_equal(run(folder, "inside").numbers, beside.numbers)


def test_the_example_runs(tmp_path: Path):
    for name in ("valve_study.toml", "fill_discharge.toml"):
        shutil.copy(ROOT / "examples" / name, tmp_path)
    study = load_study(tmp_path / "valve_study.toml")
    assert len(study) == 384
    assert study.source.scenario.plant == load_scenario(ROOT / "examples" / "fill_discharge.toml").plant
    (tmp_path / "valve_study.toml").rename(tmp_path / "study.toml")
    edited(tmp_path, "count = 64", "count = 2")
    result = run(tmp_path)
    assert result.failed.size == 0
    assert np.isfinite(result.numbers).all()


def test_the_study_of_the_page_can_be_read(tmp_path: Path):
    page = (ROOT / "docs" / "sweep.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    shutil.copy(ROOT / "examples" / "fill_discharge.toml", tmp_path)
    (tmp_path / "study.toml").write_text(blocks[0], encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    shown = set(re.findall(r"`(\w+)`", page))
    kinds = {cls.__name__ for cls in (*DESIGNS, *DISTRIBUTIONS, *OUTCOMES, Range)}
    assert kinds <= shown, f"the page lacks {kinds - shown}"
    assert len(study) == 256


# Outputs


def test_the_table_has_one_row_a_run_with_units(folder: Path):
    result = run(folder)
    rows = list(csv.DictReader((folder / "out" / "results.csv").open(encoding="utf-8")))
    assert list(rows[0]) == [
        "run", "circuit.fill.conductance [m3/(s Pa)]", "mechanism.contraction [1]", "pressure [Pa]", "reached [s]",
        "status", "reason",
    ]  # fmt: skip
    assert [float(row["pressure [Pa]"]) for row in rows] == result["pressure"].tolist()
    write_study(result, folder / "out")
    kept = np.load(folder / "out" / "courses.npz")
    assert np.array_equal(kept["course"], result["course"])
    assert kept["course_time"] == pytest.approx(np.arange(11) * 0.05)


def test_the_report_shows_design_statistics_and_figures(folder: Path):
    edited(folder, 'model = "MonteCarlo"\ncount = 22', 'model = "Saltelli"\ncount = 8')
    result = run(folder)
    chapter = study_chapter(result)
    assert [t.name for t in chapter.tables] == ["varied", "statistics", "sensitivities"]
    assert [p.name for p in chapter.plots] == [
        "histograms", "scatter-pressure", "scatter-reached", "sensitivities", "course-course",
    ]  # fmt: skip
    statistics = result.statistics().columns
    assert statistics["mean"][0] == pytest.approx(result["pressure"].mean())
    assert statistics["median"][1] == pytest.approx(np.median(result["reached"]))
    own = load_study(folder / "study.toml").source.scenario.simulate()["pressure"][-1]
    assert statistics["as it stands"][0] == pytest.approx(own, rel=1e-9)
    write_study(result, folder / "out")
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    assert "Saltelli(count=8, seed=3)" in page


def test_the_command_names_its_report_last(folder: Path):
    out = str(folder / "out")
    done = CliRunner().invoke(app, ["sweep", str(folder / "study.toml"), "--out", out, "--workers", "1"])
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1] == f"report: {out}/report.html"
    assert "Two valves: 22 runs, MonteCarlo(count=22, seed=3)" in done.stdout


# Studies that cannot be

BAD = [
    ("circuit.fill.conductance", "circuit.fil.conductance", "no number 'circuit.fil.conductance'. Did you mean 'circuit.fill.conductance'?"),
    ("mechanism.contraction", "run.stop", "the scenario has no number 'run.stop'"),
    ('low = "2 %"', "low = nan", "it must be finite"),
    ('low = "2 %"', "low = -inf", "it must be finite"),
    ('low = "2 %"', 'low = "2 mm"', "cannot become a ratio"),
    ('low = "2 %"', 'low = "20 %"', "low must be the smaller one"),
    ('low = "2 %"', 'low = "-95 %"', "allowed are"),
    ('low = "2 %", ', "", "Uniform needs 'low' (least value)"),
    ('low = "2 %"', 'lo = "2 %"', "'lo' is not known here; there are low, high. Did you mean 'low'?"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', "[]", "the list is empty"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', "[0.02, nan]", "it must be finite"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', "0.02", "write a list of values, or a distribution"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', "[0.02, 0.99]", "goes to 0.99; allowed are"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', '{ model = "Range", low = 0.0, high = 0.1, count = 0 }', "2 to 1000000 values"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', '{ model = "Truncated", inner = { model = "Normal", mean = 0.05, deviation = 0.001 }, low = 0.1, high = 0.2 }', "at least 1e-06 must"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', '{ model = "Truncated", inner = { model = "Truncated" }, low = 0.1, high = 0.2 }', "no model 'Truncated' here"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', '{ model = "Triangular", low = 0.0, mode = 0.3, high = 0.2 }', "mode 0.3 must lie within 0 to 0.2"),
    ('{ model = "Uniform", low = "2 %", high = "10 %" }', '{ model = "LogNormal", median = 0.0, log_deviation = 0.1 }', "it must be greater than zero"),
    ('model = "Uniform"', 'model = "Unifrom"', "no model 'Unifrom' here; there are Range, Uniform, Normal, LogNormal, Triangular, Truncated. Did you mean 'Uniform'?"),
    ('deviation = "0.2e-9 m3/(s Pa)"', "deviation = 0", "it must be greater than zero"),
    ('deviation = "0.2e-9 m3/(s Pa)"', 'deviation = "1 kg"', "cannot become 'm3/(s Pa)'"),
    ("count = 22", "count = 0", "at least one point is needed"),
    ("count = 22", "count = -1", "must be a whole number"),
    ("count = 22", "count = 2.5", "must be a whole number"),
    ("count = 22", "count = true", "must be a whole number"),
    ("count = 22", "count = 100_000_000", "a study has 10000000 at most"),
    ("count = 22\n", "", "MonteCarlo needs 'count'"),
    ("seed = 3", "seed = -3", "must be a whole number"),
    ('model = "MonteCarlo"', 'model = "Sobol"', "count is 22; Sobol points keep their balance for powers of two only. Take 16 or 32."),
    ('model = "MonteCarlo"', 'model = "Saltelli"', "Take 16 or 32."),
    ('model = "MonteCarlo"\ncount = 22\nseed = 3', 'model = "Grid"', "has no levels; give a list or a Range"),
    ('model = "MonteCarlo"', 'model = "Random"', "no model 'Random' here"),
    ('[design]\nmodel = "MonteCarlo"\ncount = 22\nseed = 3', "", "[design] is None; write a table with a model"),
    ('"2 bar"', '"2 mm"', "cannot become 'Pa'"),
    ('"2 bar"', "inf", "it must be finite"),
    ('model = "Final", column = "pressure"', 'model = "Final", column = "presure"', "a run has no column 'presure'"),
    ('model = "Final", column = "pressure"', 'model = "Last", column = "pressure"', "no model 'Last' here"),
    ('begin = "0.1 s"', 'begin = "0.1 s", end = "0.1 s"', "its end must be later than its begin"),
    ('begin = "0.1 s"', 'begin = "-9 s", end = "-8 s"', "from -9 to -8 s there is nothing of a run from 0 to"),
    ('begin = "0.1 s"', 'begin = "9 s"', "there is nothing of a run"),
    ('every = "0.05 s"', 'every = "0 s"', "it must be positive and finite"),
    ('every = "0.05 s"', 'every = "1 ns"', "2 to 1000000 instants"),
    ('every = "0.05 s"', 'every = "0.05 s", begin = "9 s"', "there is nothing of a run"),
    ("chunk = 4", "chunk = 0", "at least one run is written at a time"),
    ('scenario = "scenario.toml"', 'scenario = "senario.toml"', "there is no such file"),
    ('scenario = "scenario.toml"', "scenario = 5", "name a file"),
    ('scenario = "scenario.toml"', "", "scenario is None; name a file"),
    ("title", "titel", "'titel' is not known here"),
    ("[design]", '[follow]\n"circuit.discharge.conductance" = "mechanism.contraction"\n[design]', "cannot follow"),
    ("[design]", '[follow]\n"circuit.discharge.conductance" = "mechanism.contract"\n[design]', "is not under [vary]. Did you mean 'mechanism.contraction'?"),
    ("[design]", '[follow]\n"mechanism.contraction" = "mechanism.contraction"\n[design]', "varies by itself"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_a_study_that_cannot_be_is_refused(folder: Path, old: str, new: str, message: str):
    with pytest.raises(AirmuscleError) as refused:
        load_study(edited(folder, old, new))
    assert message in str(refused.value)
    assert "toml" in str(refused.value)


@pytest.mark.parametrize("table", ["vary", "outcome"])
def test_an_empty_or_missing_table_is_refused(folder: Path, table: str):
    whole = (folder / "study.toml").read_text(encoding="utf-8")
    start = whole.index(f"[{table}]")
    end = whole.find("[design]") if table == "vary" else len(whole)
    for instead in ("", f"[{table}]\n"):
        (folder / "study.toml").write_text(whole[:start] + instead + whole[end:], encoding="utf-8")
        with pytest.raises(InputError, match=rf"the table \[{table}\] is (missing|empty)"):
            load_study(folder / "study.toml")


def test_places_that_cannot_be_are_refused(folder: Path):
    with pytest.raises(InputError, match="at least one is needed"), processes(0):
        pass
    (folder / "file").write_text("", encoding="utf-8")
    with pytest.raises(FileError, match="cannot be written to"):
        run_study(load_study(folder / "study.toml"), folder / "file")
    study = str(folder / "study.toml")
    both = CliRunner().invoke(app, ["sweep", study, "--workers", "2", "--dask", "tcp://localhost:1"])
    assert both.exit_code == 1
    assert "--workers and --dask exclude each other" in both.stderr


def test_a_cluster_that_does_not_answer_is_refused(monkeypatch: pytest.MonkeyPatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("airmuscle.study.executors.ANSWER_WITHIN", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://here"):
        with pytest.raises(InputError, match=f"no Dask scheduler answers at '{address}'"), dask_cluster(address):
            pass


def test_without_dask_a_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install airmuscle\[cluster\]"), dask_cluster("tcp://127.0.0.1:8786"):
        pass
