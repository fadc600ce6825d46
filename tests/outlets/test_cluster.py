"""Every command that distributes its work gives, on the workers of a Dask cluster, what one process
gives, however the cluster is named; what fails is said in one sentence, and nothing is lost."""

from __future__ import annotations

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from cluster_commands import COMMANDS, FEW, write_inputs
from command_line import airmuscle

import airmuscle as airmuscle_package
from airmuscle.design import dask_cluster
from airmuscle.engine import solve
from airmuscle.errors import FileError, InputError, SimulationError
from airmuscle.files import load_scenario

clusters = importlib.import_module("airmuscle.engine.cluster")
EXAMPLES = Path(__file__).parents[2] / "examples"
DASK = [sys.executable, "-m", "dask"]
WORKER = ("worker", "--nworkers", "1", "--nthreads", "1", "--no-dashboard")
LOCAL = """
class = "dask.distributed.LocalCluster"
workers = 1
[arguments]
threads_per_worker = 1
dashboard_address = ":0"
"""


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """The address of a cluster of two worker processes."""
    distributed = pytest.importorskip("distributed")
    quiet = {"dashboard_address": None, "worker_dashboard_address": None}
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, **quiet
    ) as local:
        yield local.scheduler_address


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_inputs(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "name",
    [name if name in FEW else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS],
)
def test_a_command_on_a_cluster_gives_what_one_process_gives(folder: Path, cluster: str, name: str):
    alone, there = (
        airmuscle(*COMMANDS[name], "--json", "--out", folder / place, *options)
        for place, options in (("alone", ("--workers", 1)), ("there", ("--cluster", cluster)))
    )
    assert (alone.exit_code, there.exit_code) == (0, 0), there.stderr
    expected, found = ({**json.loads(each.stdout), "files": None} for each in (alone, there))
    assert found == expected
    tables = sorted(path.name for path in folder.glob("alone/*.csv"))
    assert [(folder / "there" / table).read_bytes() for table in tables] == [
        (folder / "alone" / table).read_bytes() for table in tables
    ]


@pytest.mark.parametrize("name", COMMANDS)
def test_no_command_computes_without_the_cluster_that_it_was_given(folder: Path, name: str):
    pytest.importorskip("distributed")
    result = airmuscle(*COMMANDS[name], "--out", folder / "there", "--cluster", "nowhere://host")
    assert result.exit_code == 1, result.stdout
    assert "no response from a Dask scheduler at 'nowhere://host'" in result.stderr


@pytest.mark.parametrize("address", ["nowhere://host", "host:port", "tls://127.0.0.1:9"])
def test_an_address_that_cannot_be_used_leaves_no_client(address: str):
    pytest.importorskip("distributed")
    before = threading.active_count()
    with (
        pytest.raises(InputError, match="no response from a Dask scheduler"),
        dask_cluster(address),
    ):
        raise AssertionError("the block is not entered")
    assert threading.active_count() == before


def test_a_worker_of_dask_solves_a_problem_that_was_sent_to_it(folder: Path, cluster: str):
    problem = load_scenario(folder / "scenario.toml").problem
    with dask_cluster(cluster) as executor:
        there = executor.submit(solve, problem).result()
    np.testing.assert_array_equal(there.recording["pressure"], solve(problem).recording["pressure"])


# Clusters that a file names


def test_a_scheduler_file_names_a_running_cluster(tmp_path: Path, cluster: str):
    file = tmp_path / "scheduler.json"
    file.write_text(json.dumps({"address": cluster}), encoding="utf-8")
    with dask_cluster(file) as executor:
        assert executor.submit(os.getpid).result() != os.getpid()


def test_a_toml_file_describes_a_cluster_that_ends_with_the_command(folder: Path):
    pytest.importorskip("distributed")
    (folder / "cluster.toml").write_text(LOCAL, encoding="utf-8")
    with dask_cluster("cluster.toml") as executor:
        worker = executor.submit(os.getpid).result()
        assert worker != os.getpid()
    end = time.monotonic() + 20.0
    while Path(f"/proc/{worker}").exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert not Path(f"/proc/{worker}").exists()


@pytest.mark.parametrize("name", ["cluster_local.toml", "cluster_slurm.toml"])
def test_the_examples_of_clusters_are_read(name: str):
    described = clusters.read_cluster_file(EXAMPLES / name)
    assert described.name in ("LocalCluster", "SLURMCluster")
    assert described.arguments


def test_the_class_of_a_job_queue_gets_its_arguments(tmp_path: Path, monkeypatch):
    """The package dask-jobqueue in miniature: a class that is a cluster."""
    distributed = pytest.importorskip("distributed")
    made = []

    class SLURMCluster(distributed.LocalCluster):
        def __init__(self, **arguments):
            made.append(arguments)
            super().__init__(n_workers=0, processes=False, dashboard_address=":0")

    module = type(sys)("dask_jobqueue")
    module.SLURMCluster = SLURMCluster
    monkeypatch.setitem(sys.modules, "dask_jobqueue", module)
    file = tmp_path / "cluster.toml"
    text = 'class = "dask_jobqueue.SLURMCluster"\nworkers = 1\n[arguments]\nqueue = "short"\n'
    file.write_text(text, encoding="utf-8")
    with dask_cluster(file) as executor:
        assert executor.submit(sum, (1, 2)).result() == 3
    assert made == [{"queue": "short"}]


OTHERS = (
    "os.system",
    "subprocess.Popen",
    "dask.distributed.Client",
    "dask.distributed.deploy.LocalCluster",
    "distributed.LocalCluster",
    "dask_kubernetes.KubeCluster",
    "LocalCluster",
    "",
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        *((f'class = "{name}"\nworkers = 1', "it must be a cluster class") for name in OTHERS),
        ("workers = 1", "class is None; it must be a cluster class"),
        (LOCAL.replace("workers = 1", "workers = 0"), "workers is 0; it must be the number"),
        (LOCAL.replace("workers = 1", ""), "workers is None; it must be the number"),
        (LOCAL.replace("workers", "jobs", 1), "unknown key 'jobs'; the keys are class, workers"),
        ('class = "dask_jobqueue.XCluster"\nworkers = 1\narguments = 3', "it must be a table"),
        ("class =", "is not valid TOML"),
    ],
)
def test_a_file_that_describes_no_cluster_is_refused(tmp_path: Path, content: str, message: str):
    file = tmp_path / "cluster.toml"
    file.write_text(content, encoding="utf-8")
    with pytest.raises(FileError) as raised:
        clusters.read_cluster_file(file)
    assert message in str(raised.value)
    assert str(file) in str(raised.value)


@pytest.mark.parametrize(
    ("described", "message"),
    [
        (
            clusters.ClusterFile("dask.distributed", "NoCluster", 1, {}),
            "has no cluster class NoCluster",
        ),
        (
            clusters.ClusterFile("dask.distributed", "LocalCluster", 1, {"nonsense": 1}),
            "cannot be started with these arguments",
        ),
        (clusters.ClusterFile("dask_jobqueue", "SLURMCluster", 1, {}), "pip install dask-jobqueue"),
    ],
)
def test_a_cluster_that_cannot_be_started_is_an_error(monkeypatch, tmp_path, described, message):
    pytest.importorskip("distributed")
    monkeypatch.setitem(sys.modules, "dask_jobqueue", None)
    monkeypatch.setattr(clusters, "read_cluster_file", lambda path: described)
    with pytest.raises(InputError, match=message), dask_cluster("cluster.toml"):
        pass


@pytest.mark.parametrize("content", [None, "{", "[]", '{"address": 3}', "{}"])
def test_a_file_without_an_address_is_refused(tmp_path: Path, content: str | None):
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    if content is not None:
        file.write_text(content, encoding="utf-8")
    with (
        pytest.raises(FileError, match=f"dask scheduler --scheduler-file {file}"),
        dask_cluster(file),
    ):
        pass


# Failures


class Processes:
    """A scheduler and workers as in several terminals."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "scheduler.json"
        self._folder = folder
        self._started: list[subprocess.Popen] = []

    def start(self, *arguments: str, **environment: str) -> subprocess.Popen:
        """A process `dask ARGUMENTS` with the scheduler file."""
        place = {"cwd": self._folder, "env": {**os.environ, **environment}}
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        command = [*DASK, *arguments, "--scheduler-file", str(self.file)]
        process = subprocess.Popen(command, **place, **quiet)
        self._started.append(process)
        return process

    def scheduler(self) -> subprocess.Popen:
        """A scheduler that has written its file."""
        process = self.start("scheduler", "--no-dashboard", "--port", "0")
        end = time.monotonic() + 60.0
        while not (self.file.exists() and self.file.stat().st_size):
            assert process.poll() is None
            assert time.monotonic() < end
            time.sleep(0.05)
        return process

    def close(self) -> None:
        """End all processes."""
        for process in self._started:
            process.kill()
            process.wait()


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    pytest.importorskip("distributed")
    started = Processes(tmp_path)
    yield started
    started.close()


def test_waiting_for_workers_is_said_until_one_comes(processes: Processes, monkeypatch):
    monkeypatch.setattr("airmuscle.engine.cluster.NO_WORKERS_INTERVAL", 0.3)
    processes.scheduler()
    said = []
    with dask_cluster(processes.file, said.append) as executor:
        future = executor.submit(sum, (1, 2))
        end = time.monotonic() + 20.0
        while len(said) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        processes.start(*WORKER, "--no-nanny")
        assert future.result(timeout=60.0) == 3
    assert said[0] == (
        f"the cluster '{processes.file}' has no workers, 1 tasks wait: start one: dask worker"
        f" --scheduler-file {processes.file}"
    )


def test_a_lost_scheduler_is_one_sentence_and_the_command_goes_on(
    processes: Processes, folder: Path
):
    text = (folder / "study.toml").read_text(encoding="utf-8")
    (folder / "study.toml").write_text(text.replace("12", "1200"), encoding="utf-8")
    scheduler = processes.scheduler()
    processes.start(*WORKER, "--no-nanny")
    command = [sys.executable, "-m", "airmuscle", "study", "study.toml", "--out", "out"]
    study = subprocess.Popen(
        [*command, "--cluster", "scheduler.json"], stderr=subprocess.PIPE, text=True
    )
    tasks = folder / "out" / "tasks"
    end = time.monotonic() + 120.0
    while len(list(tasks.glob("*.result"))) < 3:
        assert study.poll() is None
        assert time.monotonic() < end
        time.sleep(0.01)
    scheduler.kill()
    _, said = study.communicate(timeout=60.0)
    assert study.returncode == 1
    assert "Traceback" not in said
    saved, error = said.strip().splitlines()[-2:]
    assert re.fullmatch(r"\d+ results saved in out/tasks; the same command resumes.*", saved)
    assert error == (
        "error: the scheduler of the cluster 'scheduler.json' was lost. Start it again, and run"
        " the same command again."
    )
    assert len(list(tasks.glob("*.result"))) == int(saved.split()[0]) >= 3


def test_a_worker_of_another_version_is_one_sentence(processes: Processes, tmp_path: Path):
    other = tmp_path / "other" / "airmuscle"
    shutil.copytree(
        Path(airmuscle_package.__file__).parent, other, ignore=shutil.ignore_patterns("__pycache__")
    )
    with (other / "core" / "units.py").open("a", encoding="utf-8") as file:
        file.write("# another version\n")
    processes.scheduler()
    processes.start(*WORKER, "--no-nanny", PYTHONPATH=str(other.parent))
    with (
        pytest.raises(FileError, match="a worker of the cluster runs another version of airmuscle"),
        dask_cluster(processes.file) as executor,
    ):
        executor.submit(sum, (1, 2)).result(timeout=60.0)


def test_a_task_that_ends_its_workers_is_one_sentence(monkeypatch):
    distributed = pytest.importorskip("distributed")
    dask = importlib.import_module("dask")
    quiet = {"dashboard_address": None, "worker_dashboard_address": None}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, **quiet) as local,
        dask_cluster(local.scheduler_address) as executor,
    ):
        with pytest.raises(SimulationError, match="a task ended every worker of the cluster"):
            executor.submit(os._exit, 1).result(timeout=60.0)
        assert executor.submit(sum, (1, 2)).result(timeout=60.0) == 3


# The example for SLURM


def lines_of(script: Path) -> tuple[str, str, str]:
    """The lines of the scheduler, of a worker and of the command."""
    lines = [line.strip() for line in script.read_text(encoding="utf-8").splitlines()]
    found = []
    for beginning in ("dask scheduler", "dask worker", "airmuscle "):
        (line,) = (line for line in lines if line.startswith(beginning))
        found.append(line)
    scheduler, worker, command = found
    return scheduler, worker, command


def test_the_lines_of_the_example_for_slurm_run_as_local_processes(folder: Path):
    """One scheduler, two workers and the command, each a shell of its own."""
    pytest.importorskip("distributed")
    scheduler, worker, command = lines_of(EXAMPLES / "cluster_slurm.sh")
    scheduler = scheduler.removesuffix("&") + " --port 0"
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    environment = {**os.environ, "SLURM_CPUS_PER_TASK": "1", "PATH": path}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment}
    started = [subprocess.Popen(f"exec {scheduler}", shell=True, **quiet)]
    try:
        end = time.monotonic() + 60.0
        while not Path("scheduler.json").exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        started += [subprocess.Popen(f"exec {worker}", shell=True, **quiet) for _ in range(2)]
        done = subprocess.run(
            command, shell=True, env=environment, capture_output=True, text=True, timeout=120
        )
    finally:
        for process in started:
            process.terminate()
            process.wait()
    assert done.returncode == 0, done.stderr
    alone = airmuscle("study", "study.toml", "--out", "alone", "--workers", 1)
    assert alone.exit_code == 0
    assert Path("study/results.csv").read_bytes() == Path("alone/results.csv").read_bytes()
