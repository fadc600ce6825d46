"""`airmuscle recipe`: a muscle from tube, braid and length, the points to measure, and a fit to
them.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import airmuscle

import airmuscle as am

NINE = ("--bore", "7 mm", "--wall", "1 mm", "--length", "200 mm", "--pressure", "5 bar")
ELASTIC = ("--shore", "50", "--angle", "25 deg")


def test_the_result_comes_first_and_names_what_makes_the_band_wide(tmp_path):
    out = tmp_path / "nine"
    done = airmuscle("recipe", *NINE, *ELASTIC, "--out", str(out))
    assert done.exit_code == 0, done.output
    second_line = done.stdout.splitlines()[1]
    assert second_line.startswith("At 500 kPa this muscle contracts by 21 % without load (1")
    assert "most of it is due to the hardness" in done.stdout
    assert {path.name for path in out.iterdir()} >= {"muscle.toml", "points.csv", "report.html"}


def test_the_points_with_measured_forces_settle_the_rubber(tmp_path: Path):
    """Forces of a tube that is 20 % stiffer than predicted are filled in and fitted."""
    out = tmp_path / "nine"
    airmuscle("recipe", *NINE, *ELASTIC, "--out", str(out))
    predicted = am.files.load_law(str(out / "muscle.toml")).characteristic
    true = replace(predicted, c1=1.2 * predicted.c1)
    heading, *rows = (out / "points.csv").read_text(encoding="utf-8").splitlines()
    measured = [heading]
    for row in rows:
        pressure, length, _ = row.split(",")
        force = true.force(1e3 * float(pressure), 1.0 - float(length) / 200.0)
        measured.append(f"{pressure},{length},{force:.3f}")
    file = tmp_path / "measured.csv"
    file.write_text("\n".join(measured) + "\n", encoding="utf-8")
    done = airmuscle(
        *("fit", str(file), "--characteristic", str(out / "muscle.toml")),
        *("--fix", "geometry.braid_angle"),
        *("--resting-length", "200 mm", "--out", str(tmp_path / "fit")),
    )
    assert done.exit_code == 0, done.output
    fitted = am.files.load_law(str(tmp_path / "fit" / "muscle.toml")).characteristic
    assert fitted.c1 == pytest.approx(true.c1, rel=0.01)


def test_a_turn_of_a_thread_gives_the_angle_of_the_braid():
    by_turn = json.loads(
        airmuscle("recipe", *NINE, "--shore", "50", "--turn", "60.634 mm", "--json").stdout
    )
    by_angle = json.loads(airmuscle("recipe", *NINE, *ELASTIC, "--json").stdout)
    assert by_turn["recipe"]["free_contraction"] == pytest.approx(
        by_angle["recipe"]["free_contraction"], rel=1e-4
    )


WRONG = {
    "no elasticity": ((*NINE, "--angle", "25 deg"), "give --shore or --modulus, one of both"),
    "two angles": ((*NINE, *ELASTIC, "--turn", "60 mm"), "give --angle or --turn, one of both"),
    "a wrong unit": (("--bore", "7 bar", *NINE[2:], *ELASTIC), "--bore"),
    "a turn of nothing": ((*NINE, "--shore", "50", "--turn", "0 mm"), "it must be positive"),
    "an angle between threads": ((*NINE, "--shore", "50", "--angle", "60 deg"), "below 54.7 deg"),
    "foam": ((*NINE, "--shore", "10", "--angle", "25 deg"), "give its Young's modulus"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_missing_or_impossible_is_named_and_nothing_is_written(case: str, tmp_path: Path):
    arguments, message = WRONG[case]
    out = tmp_path / "out"
    done = airmuscle("recipe", *arguments, "--out", str(out))
    assert done.exit_code != 0
    assert message in " ".join(done.output.split())
    assert not out.exists()
