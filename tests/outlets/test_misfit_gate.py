"""A misfit of the law is said first by every command whose result rests on it: fit, comparison,
campaign and prediction. It is named with its causes, the recommendation is conditional, the muscle
file warns, and beyond ten times the scatter of the data the muscle is written only where the misfit
is accepted. Of data that the law follows nothing of this is said.

Planted is a pressure sensor that was read in steps of 50 kPa; the other laboratory is the same
without this.
"""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from command_line import airmuscle
from laboratories import MUSCLE, PRESSURE, changed, ramps, write
from widths import widened

import airmuscle as am
from airmuscle.bench.diagnosis import MAX_ACCEPTED, LawMisfit, Scatter
from airmuscle.errors import AirmuscleWarning

SMOOTH = dataclasses.replace(MUSCLE, friction=0.0)
CAUSE = "the steps of the pressure readings"


class Laboratory(NamedTuple):
    """Files of a laboratory for a law, and a further record."""

    files: list[Path]
    further: Path


def laboratory(folder: Path, step: float = 0.0, noise: float = 1.0) -> Laboratory:
    """Ramps at seven lengths whose pressure is read in steps [kPa], and one further ramp."""

    def tables(seed: int):
        made = ramps(SMOOTH, sample_time=0.1, seed=seed, noise=noise)
        return changed(made, PRESSURE, lambda p: step * np.round(p / step)) if step else made

    further = {"further": tables(60)["held_8"]}
    return Laboratory(write(tables(20), folder / "bench"), *write(further, folder / "later"))


@pytest.fixture(scope="module")
def clean(tmp_path_factory) -> Laboratory:
    return laboratory(tmp_path_factory.mktemp("clean"))


@pytest.fixture(scope="module")
def planted(tmp_path_factory) -> Laboratory:
    return laboratory(tmp_path_factory.mktemp("planted"), 50.0)


LENGTH = ("--resting-length", "300 mm")
SURFACE = ("--characteristic", "ContractileSurface", "--degree", 4)
COMMANDS = {
    "fit": ("fit", *SURFACE),
    "comparison": ("fit", "--compare"),
    "campaign": ("campaign",),
}


def run(command: str, bench: Laboratory, out: Path, *options: str):
    name, *words = COMMANDS[command]
    done = airmuscle(name, *bench.files, *words, *LENGTH, "--out", out, *options)
    assert done.exit_code == 0, done.output
    return " ".join(done.stdout.split())


def warned(path: Path) -> str:
    """The warnings of a muscle file, when it is loaded."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        am.load(path)
    return " ".join(str(each.message) for each in caught)


@pytest.mark.parametrize("command", widened(COMMANDS, lambda command: command == "fit"))
def test_a_misfit_is_said_first_and_the_muscle_needs_acceptance(command, planted, tmp_path):
    said = run(command, planted, tmp_path / "out")
    first = said[:2000]
    assert "times the scatter of the data" in first
    assert CAUSE in first
    assert "--accept-misfit" in said
    assert not (tmp_path / "out" / "muscle.toml").exists()
    run(command, planted, tmp_path / "accepted", "--accept-misfit")
    text = warned(tmp_path / "accepted" / "muscle.toml")
    assert "does not follow the data of its fit" in text
    assert CAUSE in text


@pytest.mark.slow
def test_the_recommendation_is_conditional(planted, tmp_path):
    assert "but none follows the data" in run("comparison", planted, tmp_path / "out")


@pytest.mark.parametrize("command", widened(COMMANDS, lambda command: command == "fit"))
def test_of_data_that_the_law_follows_nothing_is_said(command, clean, tmp_path):
    said = run(command, clean, tmp_path / "out")
    assert "does not follow" not in said
    assert "none follows" not in said
    assert "misfit" not in said
    assert "does not follow" not in warned(tmp_path / "out" / "muscle.toml")


def test_a_prediction_states_the_misfit_of_the_muscle_and_of_the_record(planted, clean, tmp_path):
    run("fit", planted, tmp_path / "planted", "--accept-misfit")
    run("fit", clean, tmp_path / "clean")

    def said(muscle: str, record: Path) -> str:
        path = tmp_path / muscle / "muscle.toml"
        done = airmuscle("predict", path, record, *LENGTH, "--out", tmp_path / "prediction")
        assert done.exit_code == 0, done.output
        return " ".join(done.stdout.split())

    assert "does not follow the data of its fit" in said("planted", planted.further)
    missed = said("clean", planted.further)
    assert "does not follow 1 of 1 record" in missed[:300]
    assert CAUSE in missed
    assert "does not follow" not in said("clean", clean.further)


def test_a_misfit_below_ten_times_the_scatter_is_said_and_the_muscle_is_written(tmp_path):
    bench = laboratory(tmp_path, 50.0, noise=5.0)
    said = run("fit", bench, tmp_path / "out")
    assert "the law does not follow them" in said
    assert "the misfit is equal in every repeat and is not contained" in said
    assert "--accept-misfit" not in said
    assert "does not follow the data of its fit" in warned(tmp_path / "out" / "muscle.toml")


def test_no_verdict_hangs_on_rounding_at_the_limit():
    assert not LawMisfit("", MAX_ACCEPTED * (1.0 + 1e-12)).must_be_accepted
    assert LawMisfit("", MAX_ACCEPTED + 0.01).must_be_accepted


def test_a_few_rows_must_exceed_the_limit_by_the_uncertainty_of_their_rms_error():
    scatter = Scatter(1.0, None)
    assert scatter.misfit(3.5, 1000, 100.0) is not None
    assert scatter.misfit(3.5, 8, 100.0) is None


def test_the_scatter_of_equal_files_judges_no_law():
    """Copies of a file differ by nothing, which is no repeatability."""
    assert Scatter(None, 0.0).misfit(3.5, 1000, 100.0) is None
    assert Scatter(1.0, 0.0).misfit(3.5, 1000, 100.0) is not None
