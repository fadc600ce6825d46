"""A volume law is found from a water column or from fills, with a standard deviation that repeated
data confirm.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench.statics import VolumePoints, fit_volume, volume_points
from airmuscle.errors import ColumnError, IdentificationError
from airmuscle.files import load
from airmuscle.physics import Braid, ChebyshevGeometry, ValidityRange, VirtualWork
from airmuscle.physics.muscle.characteristic import maxwell_defect
from airmuscle.recording import Recording

BRAID = Braid(0.01, 0.43, 0.2)
AIR = 287.05 * 293.15


def column(noise: float = 0.0, seed: int = 0, count: int = 40) -> Recording:
    contraction = np.linspace(0.0, 0.25, count)
    volume = BRAID.volume(contraction) + noise * np.random.default_rng(seed).standard_normal(count)
    return Recording(
        {"contraction": contraction, "volume": volume}, "column", {"resting_length": 0.2}
    )


def fill(contraction: float, *, flow: bool) -> Recording:
    """A fill from 0 to 400 kPa at a held length, with the mass of air or its flow."""
    time = np.linspace(0.0, 3.0, 6001)
    pressure = 4e5 * (1 - np.exp(-np.clip(time - 0.3, 0, None) / 0.1))
    volume = float(BRAID.volume(contraction))
    mass = (pressure + 101325) * volume / AIR
    rate = (
        np.where(time >= 0.3, 4e5 / 0.1 * np.exp(-np.clip(time - 0.3, 0, None) / 0.1), 0.0)
        * volume
        / AIR
    )
    columns = {"time": time, "pressure": pressure, "contraction": np.full(6001, contraction)}
    return Recording(
        columns | ({"mass_flow": rate} if flow else {"air_mass": mass}), f"fill {contraction}"
    )


def test_a_water_column_gives_radius_and_angle_of_the_braid():
    fit = fit_volume(volume_points([column()]), 0.2)
    assert isinstance(fit.geometry, Braid)
    assert (fit.geometry.radius, fit.geometry.braid_angle) == pytest.approx((0.01, 0.43), rel=1e-6)


@pytest.mark.parametrize(("flow", "tolerance"), [(False, 1e-6), (True, 0.01)])
def test_fills_at_held_lengths_give_the_volume_at_each(flow: bool, tolerance: float):
    contractions = [0.0, 0.06, 0.12, 0.18, 0.24]
    points = volume_points([fill(c, flow=flow) for c in contractions])
    assert points.fills == 5
    assert points.volume == pytest.approx(BRAID.volume(np.array(contractions)), rel=tolerance)
    fit = fit_volume(points, 0.2)
    assert float(fit.geometry.volume(0.15)) == pytest.approx(
        float(BRAID.volume(0.15)), rel=2 * tolerance
    )


def test_the_standard_deviation_is_the_scatter_of_repeated_experiments():
    at = np.array([0.02, 0.12, 0.24])
    fits = [fit_volume(volume_points([column(5e-7, seed)]), 0.2) for seed in range(80)]
    braids = [f for f in fits if isinstance(f.geometry, Braid)]
    assert len(braids) > 60
    scatter = np.std([f.geometry.volume(at) for f in braids], axis=0)
    stated = np.mean([f.standard_deviation(at) for f in braids], axis=0)
    assert stated == pytest.approx(scatter, rel=0.35)


def test_a_volume_that_is_no_braid_gives_a_polynomial():
    contraction = np.linspace(0.0, 0.25, 60)
    volume = (
        6e-5 + 2e-5 * np.sin(14 * contraction) + 1e-8 * np.random.default_rng(1).standard_normal(60)
    )
    fit = fit_volume(VolumePoints(contraction, volume, 0), 0.2)
    assert isinstance(fit.geometry, ChebyshevGeometry)
    assert fit.aicc["Braid"] > min(fit.aicc.values()) + 10
    assert fit.rmse < 1e-7


def test_the_maxwell_defect_of_a_force_from_this_volume_is_zero_and_of_another_volume_is_not():
    law = VirtualWork(BRAID)
    span = ValidityRange(1e5, 5e5, 0.01, 0.2)
    fit = fit_volume(volume_points([column()]), 0.2)
    assert maxwell_defect(law, fit.geometry, span).relative < 1e-6
    wide = fit_volume(VolumePoints(fit.points.contraction, 1.2 * fit.points.volume, 0), 0.2)
    assert maxwell_defect(law, wide.geometry, span).relative == pytest.approx(0.2 / 1.2, rel=1e-3)


@pytest.mark.parametrize(
    ("recording", "message"),
    [
        (
            Recording(
                {"time": np.arange(3.0), "pressure": np.arange(3.0), "contraction": np.zeros(3)},
                "x",
            ),
            "neither a column 'volume'",
        ),
        (
            Recording(
                {"pressure": [0.0, 1e4], "air_mass": [0.0, 1e-5], "contraction": [0.1, 0.1]}, "x"
            ),
            "the pressure rises by 10 kPa",
        ),
        (
            Recording(
                {"pressure": [0.0, 4e5], "air_mass": [0.0, 1e-5], "contraction": [0.1, 0.2]}, "x"
            ),
            "varies by 10.00 % during the fill",
        ),
    ],
)
def test_a_record_that_determines_no_volume_is_refused(recording: Recording, message: str):
    with pytest.raises(ColumnError, match=message):
        volume_points([recording])


@pytest.mark.parametrize("missing", ["contraction", "volume"])
def test_a_point_without_a_value_is_refused(missing: str):
    run = column()
    gap = run.with_columns(**{missing: np.where(np.arange(len(run)) == 3, np.nan, run[missing])})
    with pytest.raises(
        IdentificationError, match="1 of 40 points have no finite contraction and volume"
    ):
        fit_volume(volume_points([gap]), 0.2)


def test_too_few_lengths_are_refused():
    with pytest.raises(IdentificationError, match="four points at three contractions"):
        fit_volume(VolumePoints(np.array([0.0, 0.1]), np.array([6e-5, 8e-5]), 2), 0.2)


def test_fit_volume_writes_the_muscle_with_its_volume_and_the_maxwell_defect(tmp_path: Path):
    contraction = np.linspace(0.0, 0.25, 30)
    volume = Braid(0.01, 0.42616416607037827, 0.3).volume(
        contraction
    ) + 2e-7 * np.random.default_rng(2).standard_normal(30)
    rows = "\n".join(
        f"{100 * c:.6f};{1e6 * v:.6f}" for c, v in zip(contraction, volume, strict=True)
    )
    (tmp_path / "column.csv").write_text(f"contraction [%];volume [cm3]\n{rows}\n")
    arguments = [
        "fit-volume",
        str(tmp_path / "column.csv"),
        "--muscle",
        "dmsp-20-300",
        "--out",
        str(tmp_path / "out"),
    ]
    result = airmuscle(*arguments, "--json")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)["volume"]
    assert data["law"] == "Braid"
    parameters = {row["parameter"]: row["value"] for row in data["volume_parameters"]}
    assert parameters["radius"] == pytest.approx(0.01, rel=0.05)
    assert data["relative_Maxwell_defect"] > 0.0
    written = load(tmp_path / "out" / "muscle.toml")
    assert written.geometry.radius == pytest.approx(parameters["radius"])
    assert "standard deviation of the volume at most" in written.note
    assert "Maxwell defect" in (tmp_path / "out" / "report.html").read_text()
    alone = airmuscle(
        "fit-volume",
        tmp_path / "column.csv",
        "--resting-length",
        "300 mm",
        "--out",
        tmp_path / "alone",
    )
    assert alone.exit_code == 0, alone.output
    assert 'model = "Braid"' in (tmp_path / "alone" / "geometry.toml").read_text()


@pytest.mark.parametrize(
    ("stated", "options", "message"),
    [
        (
            (),
            (),
            (
                "error: a muscle has exactly one resting length; the data state none. Give"
                " --resting-length"
            ),
        ),
        (
            (300, 250),
            (),
            "error: a muscle has exactly one resting length; the data state 250 mm, 300 mm",
        ),
        (
            (300, 350),
            ("--muscle", "dmsp-20-300"),
            "the resting length of the data is 0.35 m, that of dmsp-20-300 0.3 m",
        ),
    ],
)
def test_fit_volume_names_the_resting_lengths_that_do_not_fit(
    stated, options, message, tmp_path: Path
):
    rows = [(0.0, 95), (0.05, 104), (0.1, 111), (0.15, 116), (0.2, 119)]
    for length in stated or (None,):
        lines = [f"{c},{v}" + (f",{length}" if length else "") for c, v in rows]
        heading = "contraction [1],volume [cm3]" + (",resting_length [mm]" if length else "")
        (tmp_path / f"column{length}.csv").write_text("\n".join([heading, *lines]))
    result = airmuscle("fit-volume", *tmp_path.glob("*.csv"), *options, "--out", tmp_path / "out")
    assert result.exit_code == 1, result.output
    assert message in " ".join(result.stderr.split())
