"""What `airmuscle fit` answers beyond the fit is what the library answers: bootstrap, profiles,
shape, bands.

Remedies are those of the command line. A surface held to a muscle's shape is the one that is
written.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle import load_data
from airmuscle.bench import (
    LevelSplit,
    bootstrap,
    confidence_band,
    find_shape_violations,
    fit,
    fit_shape_constrained,
    profile,
    weakly_determined,
    write,
)
from airmuscle.bench.estimation import levels_of
from airmuscle.bench.statics import blank_surface
from airmuscle.bench.statics.static_fit_chapter import band_plot
from airmuscle.files import load
from airmuscle.physics import ContractileSurface, Sarosi2012, ValidityRange
from airmuscle.recording import Recording

MUSCLE = "dmsp-20-300"
SURFACE = ("--characteristic", "ContractileSurface", "--degree", "2")
SAROSI = Sarosi2012(1.2e-4, 420.0, -57.0, -8.7e-3, 2.7e-3, -310.0)
BOX = ValidityRange(1e5, 6e5, 0.0, 0.2)


def bench(path: Path, noise: float = 5.0, count: int = 120, seed: int = 1) -> Recording:
    """Points on six levels of pressure, with noise that bends a surface of high degree."""
    rng = np.random.default_rng(seed)
    pressure = np.repeat(np.linspace(*BOX.pressure, 6), count // 6)
    contraction = rng.uniform(*BOX.contraction, pressure.size)
    force = SAROSI.force(pressure, contraction) + noise * rng.standard_normal(pressure.size)
    columns = {"pressure": pressure, "contraction": contraction, "force": np.maximum(force, 0.0)}
    recording = Recording(columns, path.name)
    write(recording, path)
    return recording


def test_bootstrap_and_profiles_are_those_of_the_library(tmp_path):
    recording = bench(tmp_path / "bench.csv")
    asked = (
        "--bootstrap",
        50,
        "--leave-out",
        "pressure",
        "--profile",
        "weak",
        "--profile",
        "coefficients[0]",
    )
    result = airmuscle(
        "fit", tmp_path / "bench.csv", *SURFACE, *asked, "--json", "--out", tmp_path / "fit"
    )
    assert result.exit_code == 0, result.stderr
    said = json.loads(result.stdout)["uncertainty"]
    found = fit(blank_surface(2), recording)
    drawn = bootstrap(found, recording, refits=50, by=LevelSplit("pressure"))
    ends = dict(zip(found.names, drawn.intervals().tolist(), strict=True))
    assert (said["refits"], said["resampled_groups"]) == (50, 6)
    rows = {row["parameter"]: row for row in said["intervals"]}
    assert set(rows) == set(ends)
    for name, row in rows.items():
        assert row["by_bootstrap"] == pytest.approx(ends[name], rel=1e-6)
    one = profile(found, "coefficients[0]")
    assert rows["coefficients[0]"]["by_profile"][0] == pytest.approx(one.low, rel=1e-6)
    profiled = {name for name, row in rows.items() if row["by_profile"] is not None}
    assert profiled == {"coefficients[0]", *weakly_determined(found)}
    page = (tmp_path / "fit" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert all(
        word in page
        for word in ("Uncertainty of the parameters", "50 refits, 6 blocks resampled", "by profile")
    )
    assert {"intervals.svg", "bands.svg"} <= {
        p.name for p in (tmp_path / "fit" / "figures").iterdir()
    }


def test_weak_says_so_where_no_parameter_is(tmp_path):
    bench(tmp_path / "bench.csv")
    result = airmuscle(
        "fit", tmp_path / "bench.csv", *SURFACE, "--profile", "weak", "--out", tmp_path / "fit"
    )
    assert "note: no parameter is weakly determined" in result.stdout


@pytest.mark.slow
def test_a_muscle_with_a_law_of_tied_parameters_has_them_profiled(tmp_path):
    result = airmuscle(
        "fit", MUSCLE, "--characteristic", MUSCLE, "--profile", "weak", "--json", "--out", tmp_path
    )
    weak = weakly_determined(
        fit(load(MUSCLE).characteristic, load_data(MUSCLE), fixed=("wall_thickness",))
    )
    rows = json.loads(result.stdout)["uncertainty"]["intervals"]
    assert {row["parameter"] for row in rows if row["by_profile"] is not None} == set(weak) != set()


def test_a_shape_on_request_is_the_one_written(tmp_path):
    recording = bench(tmp_path / "bench.csv", noise=60.0, count=48)
    degree = ("--characteristic", "ContractileSurface", "--degree", "4")
    loose = airmuscle("fit", tmp_path / "bench.csv", *degree, "--out", tmp_path / "loose")
    assert "note: force" in loose.stdout
    assert "of the validity range), most at" in loose.stdout
    assert "Monotonicity violations" in (tmp_path / "loose" / "report.html").read_text("utf-8")
    result = airmuscle("fit", tmp_path / "bench.csv", *degree, "--shape", "--out", tmp_path / "fit")
    assert re.search(
        r"Shape-constrained surface\nRms error [\d.]+ N with constraints", result.stdout
    )
    law = load(tmp_path / "fit" / "muscle.toml").characteristic
    assert find_shape_violations(law, law.validity_range, points=201) == ()
    assert law.coefficients == pytest.approx(
        fit_shape_constrained(blank_surface(4), recording).model.coefficients, abs=1e-6
    )
    assert "Shape-constrained surface" in (tmp_path / "fit" / "report.html").read_text("utf-8")


def test_the_force_is_zero_where_the_muscle_hangs_free(tmp_path):
    bench(tmp_path / "bench.csv")
    asked = (
        *SURFACE,
        "--shape",
        "--free-contraction",
        "2 bar=18 %",
        "--free-contraction",
        "600 kPa=19.5 %",
    )
    assert (
        airmuscle("fit", tmp_path / "bench.csv", *asked, "--out", tmp_path / "fit").exit_code == 0
    )
    law = load(tmp_path / "fit" / "muscle.toml").characteristic
    for pressure, contraction in ((2e5, 0.18), (6e5, 0.195)):
        assert law.unclamped_force(pressure, contraction) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        ((*SURFACE, "--free-contraction", "2 bar=18 %"), 2, "--free-contraction requires --shape"),
        ((*SURFACE, "--shape", "--free-contraction", "2 bar"), 2, "such as '3 bar=18 %'"),
        (
            (*SURFACE, "--shape", "--free-contraction", "2 N=18 %"),
            1,
            "--free-contraction: unit 'N' cannot be converted to 'Pa'",
        ),
        (
            (*SURFACE, "--shape", "--free-contraction", "2 bar=1800 %"),
            2,
            "must be from 0 to 100 %, not '1800 %'",
        ),
        (
            (*SURFACE, "--shape", "--free-contraction", "2 bar=-18 %"),
            2,
            "must be from 0 to 100 %, not '-18 %'",
        ),
        (("--compare", "--shape"), 2, "it excludes --compare"),
        (
            ("--characteristic", "Sarosi2012", "--shape"),
            1,
            "only a ContractileSurface can be constrained",
        ),
        ((*SURFACE, "--profile", "coefficient[0]"), 1, "no parameter 'coefficient[0]'"),
        ((*SURFACE, "--bootstrap", "50", "--leave-out", "run"), 1, "use --leave-out contraction"),
        ((*SURFACE, "--bootstrap", "3"), 2, "not in the range 20<=x<=100000"),
        (
            (*SURFACE, "--profile", "coefficients[0]", "--robust", "5 N"),
            1,
            "a robust loss is no likelihood",
        ),
        (
            (*SURFACE, "--leave-out", "row"),
            2,
            "allowed range: run, specimen, contraction, pressure, block",
        ),
        (("--characteristic", "ContractileSurface", "--degree", "9"), 1, "use --degree 5"),
    ],
)
def test_what_cannot_be_asked_is_refused(options, code, message, tmp_path):
    bench(tmp_path / "bench.csv")
    result = airmuscle("fit", tmp_path / "bench.csv", *options, "--out", tmp_path / "fit")
    assert result.exit_code == code
    said = " ".join(result.stderr.replace("│", " ").split())
    assert message in said
    assert not (tmp_path / "fit").exists()


def test_a_law_that_data_can_start_needs_no_entry(tmp_path):
    bench(tmp_path / "bench.csv", noise=0.5)
    result = airmuscle(
        "fit",
        tmp_path / "bench.csv",
        "--characteristic",
        "Sarosi2012",
        "--json",
        "--out",
        tmp_path / "f",
    )
    assert json.loads(result.stdout)["fit"]["rms_error"] == pytest.approx(0.5, rel=0.2)


# Hints


def test_the_report_names_options_too(tmp_path):
    recording = bench(tmp_path / "bench.csv", noise=30.0)
    assert (recording["force"] == 0).any()
    airmuscle("fit", tmp_path / "bench.csv", *SURFACE, "--out", tmp_path / "fit")
    page = (tmp_path / "fit" / "report.html").read_text("utf-8")
    assert "To treat them as measured values, use --uncensored." in page
    assert "censoring=" not in page


# The figure of bands


def test_the_figure_draws_the_band_that_the_library_gives(tmp_path):
    found = fit(blank_surface(2), bench(tmp_path / "bench.csv"))
    plot = band_plot(found)
    left, right = plot.draw().axes
    curve = left.lines[0]
    half = right.lines[0]
    x = np.asarray(curve.get_xdata()) / 100
    points = Recording({"pressure": np.full(x.size, 1e5), "contraction": x}, "curve")
    expected = confidence_band(found, points)
    kept = np.isfinite(x)
    assert np.asarray(curve.get_ydata())[kept] == pytest.approx(expected.value[kept])
    assert np.asarray(half.get_ydata())[kept] == pytest.approx(
        (expected.high - expected.value)[kept]
    )
    assert left.get_ylabel() == "force [N]"


def test_without_a_point_to_spare_there_is_no_band():
    columns = {
        "pressure": [1e5, 3e5, 1e5],
        "contraction": [0.0, 0.0, 0.1],
        "force": [100.0, 300.0, 50.0],
    }
    rows = Recording({name: np.array(values) for name, values in columns.items()}, "three")
    assert band_plot(fit(ContractileSurface.blank(1, max_force=1e3), rows)) is None


def test_levels_are_those_held_and_a_ramp_has_quantiles():
    held = np.repeat([1e5, 2e5, 4e5], 20) + np.tile([-50.0, 50.0], 30)
    assert levels_of(held, 5) == pytest.approx([1e5, 2e5, 4e5])
    assert levels_of(np.repeat(np.linspace(1e5, 6e5, 11), 5), 3).size == 3
    assert levels_of(np.linspace(0.0, 1e5, 1001), 3) == pytest.approx([1e4, 5e4, 9e4])


def test_exclusions_of_a_comparison_name_options_everywhere(tmp_path):
    bench(tmp_path / "bench.csv", noise=1.0, count=60)
    asked = ("--compare", "--leave-out", "pressure", "--profile", "weak")
    result = airmuscle("fit", tmp_path / "bench.csv", *asked, "--out", tmp_path / "fit")
    assert result.exit_code == 0, result.stderr
    page = (tmp_path / "fit" / "report.html").read_text("utf-8")
    assert "use --degree" in page
    assert re.search(r"surface of degree 6 +the data cannot separate", result.stdout)
    assert "fixed=" not in result.stdout + page
    assert "degree=" not in result.stdout + page
    assert "Uncertainty of the parameters" in result.stdout
