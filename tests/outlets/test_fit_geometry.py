"""A fitted muscle has one geometry and one resting length, those of the data; without a geometry
its file says so.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench.statics import blank_surface
from airmuscle.errors import ParameterError, UnknownNameError
from airmuscle.files import load, save
from airmuscle.files.library import scale_to_length
from airmuscle.physics import Braid, EffectiveLength, MartensBoblan2017

MUSCLE = "dmsp-20-300"
SURFACE = ("--characteristic", "ContractileSurface", "--degree", 3)
BRAID = ("--braid", "radius=10 mm, angle=24.4 deg")
SCENARIO = """
title = "Fill of a fitted muscle"
[plant]
gas = "Isothermal"
[plant.muscle]
library = "fit/muscle.toml"
damper = { model = "LinearDamper", damping = "200 N s/m" }
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "500 kPa(a)" }
fill = { model = "Valve", conductance = "2.6167e-9 m3/(s Pa)", critical_ratio = 0.433 }
discharge = { model = "Valve", conductance = "2.6167e-9 m3/(s Pa)", critical_ratio = 0.433 }
[plant.mechanism]
model = "HangingMass"
mass = "10 kg"
[input]
fill = [["0.1 s", 1]]
[run]
duration = "1 s"
output_times = "10 ms"
"""
BARE_SCENARIO = re.sub(
    r"\[plant.muscle\]\n(.*)\n.*\n",
    "",
    SCENARIO.replace("[plant]", '[plant]\nmuscle = "fit/muscle.toml"'),
)


def bench(path: Path, radius: float = 0.01) -> Path:
    """Points of a DMSP-20 of 200 mm with this radius; the file states no resting length."""
    law = scale_to_length(load(MUSCLE).characteristic, 0.2, "test")
    law = replace(law, geometry=replace(law.geometry, radius=radius))
    pressure, contraction = (
        g.ravel() for g in np.meshgrid(np.linspace(1e5, 6e5, 6), np.linspace(0.01, 0.2, 9))
    )
    force = law.force(pressure, contraction)
    rows = [
        f"{p!r},{c!r},{f!r}"
        for p, c, f in zip(*(v.tolist() for v in (pressure, contraction, force)), strict=True)
    ]
    path.write_text("\n".join(["pressure [Pa],contraction [1],force [N]", *rows]), encoding="utf-8")
    return path


def fitted(folder: Path, *options):
    """The result of a fit of the 200 mm muscle, written to folder/fit."""
    file = bench(folder / "bench.csv", radius=0.0105)
    return airmuscle("fit", file, *options, "--resting-length", "200 mm", "--out", folder / "fit")


def failed_run(folder: Path, scenario: str) -> str:
    """The error of a simulation of a scenario in this folder."""
    (folder / "fill.toml").write_text(scenario, encoding="utf-8")
    run = airmuscle("simulate", folder / "fill.toml", "--out", folder / "run")
    assert run.exit_code == 1
    return " ".join(run.stderr.split())


def test_the_resting_length_of_the_data_is_that_of_law_and_geometry(tmp_path):
    result = fitted(tmp_path, "--characteristic", MUSCLE)
    assert result.exit_code == 0, result.output
    assert "has a resting length of" not in result.stdout
    entry = load(tmp_path / "fit" / "muscle.toml")
    assert entry.characteristic.geometry.resting_length == 0.2
    assert entry.geometry == entry.characteristic.geometry


def test_a_fitted_radius_is_that_of_the_geometry(tmp_path):
    assert fitted(tmp_path, "--characteristic", MUSCLE).exit_code == 0
    entry = load(tmp_path / "fit" / "muscle.toml")
    assert entry.geometry.radius == pytest.approx(0.0105, rel=1e-3)
    assert "[geometry]" not in (tmp_path / "fit" / "muscle.toml").read_text(encoding="utf-8")


def test_the_geometry_beside_a_surface_has_the_length_of_the_data(tmp_path):
    surface = replace(load(MUSCLE), characteristic=blank_surface(2, 5000.0), checks=())
    save(surface, tmp_path / "initial.toml")
    assert fitted(tmp_path, "--characteristic", tmp_path / "initial.toml").exit_code == 0
    braid = load(MUSCLE).geometry
    assert load(tmp_path / "fit" / "muscle.toml").geometry == replace(braid, resting_length=0.2)


def test_a_muscle_that_cannot_be_scaled_is_refused(tmp_path):
    result = fitted(tmp_path, "--characteristic", "saga2007")
    said = " ".join(result.stderr.split())
    assert result.exit_code == 1
    assert "--characteristic saga2007: " in said
    assert (
        "resting length of the data is 0.2 m, and Saga2007 cannot be scaled to another length"
        in said
    )
    assert not (tmp_path / "fit").exists()


def test_a_scaled_muscle_pulls_as_the_original_at_every_contraction():
    law = load(MUSCLE).characteristic
    assert isinstance(law, MartensBoblan2017)
    shorter = scale_to_length(law, 0.2, "test")
    assert shorter.geometry == replace(law.geometry, resting_length=0.2)
    contractions = np.linspace(0.0, 0.25, 11)
    assert shorter.force(4e5, contractions) == pytest.approx(law.force(4e5, contractions))


def test_a_law_with_its_own_resting_length_is_scaled():
    family = EffectiveLength(blank_surface(2), 0.3, 0.01)
    assert scale_to_length(family, 0.2, "test").resting_length == 0.2
    assert scale_to_length(blank_surface(2), 0.2, "test") == blank_surface(2)
    with pytest.raises(
        ParameterError, match=r"^here: resting_length of .* cannot be scaled to another length"
    ):
        scale_to_length(load("saga2007").geometry, 0.2, "here")


def test_a_surface_with_a_braid_is_simulated_in_one_step(tmp_path):
    result = fitted(tmp_path, *SURFACE, *BRAID)
    assert result.exit_code == 0, result.output
    assert "lacks a [geometry]" not in result.stdout
    assert load(tmp_path / "fit" / "muscle.toml").geometry == Braid(0.01, np.deg2rad(24.4), 0.2)
    (tmp_path / "fill.toml").write_text(SCENARIO, encoding="utf-8")
    run = airmuscle("simulate", tmp_path / "fill.toml", "--out", tmp_path / "run")
    assert run.exit_code == 0, run.output


def test_a_muscle_without_a_geometry_says_how_to_give_and_measure_it(tmp_path):
    result = fitted(tmp_path, *SURFACE)
    (line,) = (line for line in result.stdout.splitlines() if "lacks a [geometry]" in line)
    entry = load(tmp_path / "fit" / "muscle.toml")
    errors = [failed_run(tmp_path, text) for text in (SCENARIO, BARE_SCENARIO)]
    with pytest.raises(UnknownNameError) as error:
        _ = entry.muscle
    for said in (line, entry.note, *errors, str(error.value)):
        assert "--braid 'radius=10 mm, angle=24.4 deg'" in said
        assert "from the outer diameter at rest and at full contraction" in said
    again = json.loads(fitted(tmp_path, *SURFACE, "--json").stdout)
    assert any("lacks a [geometry]" in note for note in again["fit"]["notes"])


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ((*SURFACE, "--braid", "radius=10 mm"), 2, "must give radius and angle once each, such as"),
        (
            (*SURFACE, "--braid", "radius=10 mm, angle=24 deg, turns=2"),
            2,
            "must give radius and angle once each",
        ),
        (
            (*SURFACE, "--braid", "radius=10, angle=24.4 deg"),
            1,
            "--braid, radius: '10' has no unit",
        ),
        (
            (*SURFACE, "--braid", "radius=10 mm, angle=24.4 mm"),
            1,
            "--braid, angle: unit 'mm' cannot be converted",
        ),
        ((*SURFACE, "--braid", "radius=10 m, angle=24.4 deg"), 1, "--braid: Braid.radius"),
        (
            (*SURFACE, *BRAID),
            1,
            "--braid: a braid has exactly one resting length; the data state none. Give --resting",
        ),
        (
            ("--characteristic", MUSCLE, *BRAID),
            1,
            "--braid: MartensBoblan2017 contains its geometry",
        ),
        (
            ("--compare", *BRAID),
            1,
            "--braid: a braid has exactly one resting length; the data state none",
        ),
    ],
)
def test_a_braid_that_cannot_be_is_refused(options, code, message, tmp_path):
    result = airmuscle("fit", bench(tmp_path / "bench.csv"), *options, "--out", tmp_path / "fit")
    assert result.exit_code == code, result.output
    assert message in " ".join(result.stderr.replace("│", " ").split())
    assert not (tmp_path / "fit").exists()
