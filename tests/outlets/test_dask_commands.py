"""Every command that distributes its work gives, on the workers of a Dask cluster, what one process
gives; a problem, too, is solved there."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from scenario_files import HELD_FILL, HELD_STUDY, MUSCLE_FILE, PRESSURE_LOOP

from airmuscle import Recording, load, load_data
from airmuscle.bench import write
from airmuscle.design import dask_cluster
from airmuscle.engine import solve
from airmuscle.errors import InputError
from airmuscle.files import load_scenario

COMMANDS = {
    "compare": (
        "fit",
        "map.csv",
        "--compare",
        "--characteristic",
        "Sarosi2012",
        "--characteristic",
        "Hunt2017",
    ),
    "study": ("study", "study.toml"),
    "bootstrap": (
        "fit",
        "map.csv",
        "--characteristic",
        "Sarosi2012",
        "--bootstrap",
        20,
        "--leave-out",
        "pressure",
    ),
    "tune": ("tune", "loop.toml", "--budget", 64, "--draws", 1),
    "benchmark": (
        "benchmark",
        "--controller",
        "PID",
        "--task",
        "step",
        "--budget",
        112,
        "--truths",
        1,
        "--runs",
        2,
    ),
    "campaign": ("campaign", "map.csv", "loop.csv", "--resting-length", "300 mm"),
}
FEW = ("study",)
"""The command that runs by default, whose workers start in a third of the time of those that
compare laws.
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
    """The input of all commands: a force map, a loop, a scenario with a controller and a study."""
    contents = {
        "muscle": MUSCLE_FILE,
        "scenario": HELD_FILL,
        "loop": PRESSURE_LOOP,
        "study": HELD_STUDY.replace("48", "12"),
    }
    for name, content in contents.items():
        (tmp_path / f"{name}.toml").write_text(content, encoding="utf-8")
    write(load_data("dmsp-20-300"), tmp_path / "map.csv")
    time = np.linspace(0.0, 40.0, 401)
    contraction = 0.1 - 0.1 * np.cos(0.1 * np.pi * time)
    force = load("dmsp-20-300").characteristic.force(3e5, contraction) - 8.0 * np.sign(
        np.gradient(contraction)
    )
    columns = {"time": time, "pressure": np.full(401, 3e5), "contraction": contraction}
    noise = np.random.default_rng(1).standard_normal(401)
    write(Recording({**columns, "force": force + noise}, "loop"), tmp_path / "loop.csv")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "name",
    [name if name in FEW else pytest.param(name, marks=pytest.mark.slow) for name in COMMANDS],
)
def test_a_command_on_a_cluster_gives_what_one_process_gives(folder: Path, cluster: str, name: str):
    alone, there = (
        airmuscle(*COMMANDS[name], "--json", "--out", folder / place, *options)
        for place, options in (("alone", ("--workers", 1)), ("there", ("--dask", cluster)))
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
    result = airmuscle(*COMMANDS[name], "--out", folder / "there", "--dask", "nowhere://host")
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
