"""Rows weigh by what their sensors tell: recordings of a coarse and a fine rig fitted together meet
the truth better.

One rig weighs all its rows alike. Where the order of rows is no history, noise cannot be told and
resolution decides.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import estimate_sensors, fit, write
from airmuscle.bench.estimation import sensor_deviations
from airmuscle.physics import Braid, ContractileSurface, TonduLopez2000
from airmuscle.recording import Recording

MUSCLE = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.2)
SURFACE = ContractileSurface.blank(3, max_force=1e5)


def ramp(
    pressure: float, step: float, noise: float, seed: int, name: str = "ramp", count: int = 400
) -> Recording:
    """A slow isobaric ramp whose force is rounded to a step, with time."""
    rng = np.random.default_rng(seed)
    contraction = np.linspace(0.0, 0.2, count)
    force = MUSCLE.force(pressure, contraction) + noise * rng.standard_normal(count)
    columns = {
        "time": 0.1 * np.arange(count),
        "pressure": np.full(count, pressure),
        "contraction": contraction,
    }
    return Recording({**columns, "force": step * np.round(force / step)}, name)


def rigs(seed: int) -> list[Recording]:
    """A fine rig at some pressures, a coarse and noisy one at others."""
    fine = [
        ramp(p, 0.2, 0.3, seed + i, f"fine{i}") for i, p in enumerate((1e5, 2.4e5, 3.8e5, 5.2e5))
    ]
    coarse = [
        ramp(p, 12.0, 15.0, seed + 9 + i, f"coarse{i}")
        for i, p in enumerate((1.7e5, 3.1e5, 4.5e5, 6e5))
    ]
    return [*fine, *coarse]


def test_the_deviations_are_those_of_noise_and_rounding():
    found = sensor_deviations(rigs(1), "force")
    fine = np.hypot(0.3, 0.2 / 12**0.5)
    coarse = np.hypot(15.0, 12.0 / 12**0.5)
    assert found == pytest.approx([fine] * 4 + [coarse] * 4, rel=0.25)
    assert len(set(found.tolist())) == 2, "recordings of one rig share its sensor"


def test_readings_that_change_by_few_steps_are_of_one_rig():
    runs = [ramp(1e5, 4.0, 1.2, seed) for seed in range(12)]
    noise = [estimate_sensors(run)["force"].noise for run in runs]
    assert min(noise) == 0.0, "the noise of some is estimated as none"
    assert max(noise) > 2.0, "and that of others as a step"
    assert sensor_deviations(runs, "force") is None


def test_without_time_the_resolution_decides():
    runs = [ramp(1e5, step, 0.5, 1, count=1500) for step in (0.2, 0.2, 6.0)]
    shuffled = [
        Recording({n: run[n] for n in ("pressure", "contraction", "force")}, run.origin)
        for run in runs
    ]
    assert sensor_deviations(shuffled, "force") == pytest.approx(
        np.array([0.2, 0.2, 6.0]) / 12**0.5, rel=0.02
    )
    assert sensor_deviations(shuffled[:2], "force") is None


def test_one_rig_and_sensors_that_show_nothing_weigh_all_alike():
    runs = rigs(1)
    assert sensor_deviations(runs[:4], "force") is None
    assert sensor_deviations(runs[:1], "force") is None
    still = runs[0].with_columns(force=np.full(400, 5.0))
    assert sensor_deviations([still, runs[5]], "force") is None, (
        "a sensor without noise or resolution tells nothing"
    )
    assert sensor_deviations([runs[0].rows(slice(0, 0)), runs[5]], "force") is None
    assert sensor_deviations(runs, "temperature") is None


def test_the_default_of_a_fit_is_the_sigma_of_the_sensors():
    runs = rigs(2)
    sigma = np.repeat(sensor_deviations(runs, "force"), [len(run) for run in runs])
    default = fit(SURFACE, runs)
    stated = fit(SURFACE, runs, sigma=sigma)
    assert default.values == pytest.approx(stated.values, rel=1e-9)
    assert any("weighted by standard deviations of 0." in note for note in default.notes)
    alike = fit(SURFACE, runs, sigma=1.0)
    assert not any("weighted by" in note for note in alike.notes)
    assert np.abs(default.values - alike.values).max() > 0.1
    assert not any("weighted by" in note for note in fit(SURFACE, runs[:4]).notes)


@pytest.mark.slow
def test_weights_by_sensor_come_nearer_to_the_truth_in_the_mean():
    grid = [g.ravel() for g in np.meshgrid(np.linspace(1e5, 5.2e5, 25), np.linspace(0.0, 0.19, 25))]
    true = MUSCLE.force(*grid)

    def distance(law):
        return float(np.mean((law.force(*grid) - true) ** 2))

    weighted = []
    alike = []
    for seed in range(100, 120):
        runs = rigs(seed)
        weighted.append(distance(fit(SURFACE, runs).model))
        alike.append(distance(fit(SURFACE, runs, sigma=1.0).model))
    assert np.mean(weighted) < 0.75 * np.mean(alike)


def test_the_command_line_weighs_by_sensor_unless_told(tmp_path):
    files = []
    for run in rigs(3):
        files.append(str(tmp_path / f"{run.origin}.csv"))
        write(run, files[-1])
    law = (
        "--characteristic",
        "ContractileSurface",
        "--degree",
        "3",
        "--json",
        "--out",
        str(tmp_path / "fit"),
    )
    notes = [
        json.loads(airmuscle("fit", *files, *law, *more).stdout)["fit"]["notes"]
        for more in ((), ("--equal-weights",))
    ]
    assert [any("test rigs with different sensors" in note for note in each) for each in notes] == [
        True,
        False,
    ]
    assert any(
        note.endswith("To weight all rows equally, use --equal-weights.") for note in notes[0]
    )
    page = (tmp_path / "fit" / "report.html").read_text(encoding="utf-8")
    assert "sigma=1.0" not in page
