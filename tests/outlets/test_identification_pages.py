"""The pages on identification, hysteresis, reading and studies are true: their code runs on data
that a plant made.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle import read
from airmuscle.bench import Experiment, InitialConditions, write
from airmuscle.engine import Schedule, simulate
from airmuscle.files import load
from airmuscle.papers.hosovsky_plant import UnpublishedParameters, hanging_load
from airmuscle.papers.hosovsky_plant import plant as third_paper
from airmuscle.physics import MaxwellSlip, WallHeatTransfer
from airmuscle.recording import Recording

DOCS = Path(__file__).parents[2] / "docs"
LAW = load("dmsp-20-300").characteristic


def run(page, **given):
    """What the page's code leaves, typed in one place where `given` is there already."""
    text = (DOCS / page).read_text(encoding="utf-8")
    found = {"__name__": "__main__", **given}
    blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, page, "exec"), found)
    return found


def test_the_code_on_static_identification_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for seed in (1, 2, 3):
        rng = np.random.default_rng(seed)
        p, eps = (
            side.ravel()
            for side in np.meshgrid(np.linspace(1e5, 6e5, 6), np.linspace(0.02, 0.2, 7))
        )
        force = LAW.force(p, eps) + rng.normal(0.0, 1.0, p.size)
        write(
            Recording({"pressure": p, "contraction": eps, "force": force}, "bench"),
            Path(f"run{seed}.csv"),
        )
    found = run("guides/identification.md")
    assert found["fit"].model == found["found"].recommended.fit.model
    assert "Best of those compared" in capsys.readouterr().out, "which do not follow the data"
    assert len(read(".")) == 3  # the folder that the page on reading reads


def test_the_code_on_dynamic_identification_runs(capsys):
    plant = replace(
        third_paper(UnpublishedParameters(), hanging_load(UnpublishedParameters())),
        gas=WallHeatTransfer(),
    )
    command = Schedule({"fill": ((0.1, 1.0), (0.8, 0.0)), "discharge": ((1.0, 1.0),)})
    exact = simulate(plant, command, duration=1.5, output_times=0.01)
    rng = np.random.default_rng(4)
    noise = {"pressure": 500.0, "position": 5e-5}
    records = [
        exact.with_columns(
            **{name: exact[name] + s * rng.standard_normal(len(exact)) for name, s in noise.items()}
        )
        for _ in range(2)
    ]
    another = Experiment(records[1], command, InitialConditions.at_rest(plant, pressure=0.0))
    found = run(
        "guides/dynamic-identification.md",
        plant=plant,
        recording=records[0],
        command=command,
        another=another,
    )
    coefficient = found["fit"]["gas.coefficient"]
    assert coefficient.value == pytest.approx(25.0, abs=4 * coefficient.stderr)
    assert coefficient.stderr < 2.5
    printed = capsys.readouterr().out
    assert "gas.coefficient" in printed
    assert "initial left.pressure of record 1" in printed


def test_the_code_on_prediction_runs(capsys):
    run("guides/prediction.md")
    assert capsys.readouterr().out == "15 N, 39.1 N in row 125\n"


def test_the_code_on_hysteresis_runs(tmp_path, monkeypatch, capsys):
    """Also its command, on the files that the code writes."""
    monkeypatch.chdir(tmp_path)
    found = run("guides/hysteresis.md")
    assert isinstance(found["muscle"].friction, MaxwellSlip)
    assert len(found["joint"][0].agreement) == 2
    assert capsys.readouterr().out.strip().endswith("The data justify this friction.")
    (command,) = re.findall(
        r"```sh\nairmuscle (hysteresis .*?)\n```",
        (DOCS / "guides/hysteresis.md").read_text(),
        re.DOTALL,
    )
    done = airmuscle(*shlex.split(command.replace("\\\n", " ")))
    assert done.exit_code == 0, done.output
    assert "muscle: friction/muscle.toml" in done.stdout


def test_the_code_on_studies_runs(tmp_path, monkeypatch, capsys):
    """The study of the examples, with a grid of its own so that it is soon done."""
    monkeypatch.chdir(tmp_path)
    examples = DOCS.parent / "examples"
    (tmp_path / "fill_discharge.toml").write_bytes((examples / "fill_discharge.toml").read_bytes())
    text = (examples / "valve_study.toml").read_text(encoding="utf-8")
    (tmp_path / "study.toml").write_text(text.replace("count = 64", "count = 2"), encoding="utf-8")
    found = run("guides/study.md")
    assert not found["result"].failed.size
    assert (tmp_path / "out" / "tasks").exists()
    assert re.match(r"0\.\d+ ", capsys.readouterr().out)
