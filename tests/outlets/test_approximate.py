"""`airmuscle approximate` brings one law near another, and the error it prints is the one between
the two files.

A law that holds the other gives it back; a validity range that is not known is asked for; other
parts of the muscle stay.
"""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.files import load

MUSCLE = "dmsp-20-300"


def test_the_printed_error_is_that_between_the_two_files(tmp_path):
    result = airmuscle(
        "approximate",
        MUSCLE,
        "ContractileSurface",
        "--degree",
        3,
        "--out",
        tmp_path / "m.toml",
        "--json",
    )
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)["approximation"]
    first = load(MUSCLE)
    second = load(tmp_path / "m.toml")
    assert (second.geometry, second.damper, second.checks) == (first.geometry, first.damper, ())
    grid = [
        g.ravel()
        for g in np.meshgrid(
            np.linspace(*first.validity_range.pressure, 90),
            np.linspace(*first.validity_range.contraction, 90),
        )
    ]
    force = first.characteristic.force(*grid)
    error = (second.characteristic.force(*grid) - force)[force > 0]
    assert said["rms_error"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.15)
    assert abs(said["maximum_error"]) == pytest.approx(np.abs(error).max(), rel=0.15)
    assert max(row["maximum_error"] for row in said["bands"]) == pytest.approx(
        abs(said["maximum_error"])
    )
    together = np.sqrt(np.mean([row["rms_error"] ** 2 for row in said["bands"]]))
    assert together == pytest.approx(said["rms_error"], rel=0.15)


def test_a_law_that_holds_the_other_gives_it_back(tmp_path):
    airmuscle(
        "approximate",
        "chou-hannaford",
        "ContractileSurface",
        "--degree",
        3,
        "--out",
        tmp_path / "surface.toml",
    )
    result = airmuscle("approximate", tmp_path / "surface.toml", "ChouHannaford1996", "--json")
    said = json.loads(result.stdout)["approximation"]
    assert said["rms_error"] < 1e-6
    before = load("chou-hannaford").characteristic
    assert {p["parameter"]: p["value"] for p in said["parameters"]}[
        "geometry.braid_angle"
    ] == pytest.approx(before.geometry.braid_angle, rel=1e-4)


def test_a_stated_end_takes_the_place_of_the_muscles(tmp_path):
    wide = json.loads(airmuscle("approximate", MUSCLE, "Sarosi2012", "--json").stdout)
    narrow = json.loads(
        airmuscle(
            "approximate",
            MUSCLE,
            "Sarosi2012",
            "--min-pressure",
            "3 bar",
            "--max-contraction",
            "15 %",
            "--json",
        ).stdout
    )
    wide = wide["approximation"]
    narrow = narrow["approximation"]
    assert narrow["pressure_range"][0] == narrow["bands"][0]["pressure"][0] == 3e5
    assert narrow["contraction_range"][1] == 0.15
    assert narrow["rms_error"] < 0.5 * wide["rms_error"]


def test_the_table_is_printed(tmp_path):
    said = airmuscle(
        "approximate", MUSCLE, "ContractileSurface", "--degree", 2, "--out", tmp_path / "m.toml"
    ).stdout
    assert "by ContractileSurface over 35 kPa to 675 kPa and 1.33 % to 26.00 %" in said
    assert "pressure [kPa]" in said
    assert "maximum error [N]" in said
    assert said.splitlines()[-1] == f"muscle: {tmp_path / 'm.toml'}"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("borzikova-exponential", "ContractileSurface"),
            "has no validity range for the approximation; give --min-pressure, ",
        ),
        ((MUSCLE, "ContractileSurfac"), "no muscle or law 'ContractileSurfac'"),
        ((MUSCLE, "Saga2007"), "MODEL: Saga2007 needs initial values"),
        ((MUSCLE, "hunt"), "has no force at"),
        (
            (MUSCLE, "ContractileSurface", "--min-pressure", "7 bar"),
            "must be less than max_pressure",
        ),
        (
            (
                MUSCLE,
                "ContractileSurface",
                "--min-contraction",
                "25.9 %",
                "--max-pressure",
                "1 bar",
            ),
            "gives no positive force on the validity range, so it cannot be converted",
        ),
        (
            (MUSCLE, "ContractileSurface", "--min-pressure", "7 mm"),
            "--min-pressure: unit 'mm' cannot be converted to 'Pa'",
        ),
    ],
)
def test_what_cannot_be_converted_is_refused(arguments, message, tmp_path):
    result = airmuscle("approximate", *arguments, "--out", tmp_path / "m.toml")
    assert result.exit_code == 1
    assert message in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("limits", [(), ("--min-contraction", "0.01 %")])
def test_an_approximation_of_an_infinite_force_is_refused_and_the_remedy_works(limits, tmp_path):
    out = tmp_path / "m.toml"
    command = ("approximate", "saga2007", "ContractileSurface")
    refused = airmuscle(*command, *limits, "--out", out)
    assert refused.exit_code == 1
    assert not out.exists()
    assert "RuntimeWarning" not in refused.stderr
    if limits:
        assert "does not approximate the law: its rms error is" in refused.stderr
        assert "Choose a smaller validity range" in refused.stderr
        proposed = ("1 %", "40 %")
    else:
        said = r"the force of Saga2007 is unbounded at a contraction of 0 % .* from (.*) to (.*)\."
        proposed = re.search(said, refused.stderr).groups()
    ends = ("--min-contraction", proposed[0], "--max-contraction", proposed[1])
    done = airmuscle(*command, *ends, "--out", out, "--json")
    assert done.exit_code == 0, done.stderr
    errors = json.loads(done.stdout)["approximation"]
    surface = load(out).characteristic
    assert errors["rms_error"] < 30.0
    assert np.abs(surface.coefficients).max() < 1e4
    assert surface.force(1e5, 0.2) == pytest.approx(
        load("saga2007").characteristic.force(1e5, 0.2), abs=60
    )
