"""Which runs to measure: a D-optimal design has the greatest det of the Fisher information Sum J^T
J among designs of as many runs, so for a line y = a + b x its points stand at the ends; every run
stays within the bench's limits.
"""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import BenchLimits, fit, read_csv
from airmuscle.bench.statics import candidate_runs, optimal_design
from airmuscle.bench.statics.experiment_design import _log_determinant, _select_runs
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.physics import Braid, ContractileSurface, TonduLopez2000, ValidityRange
from airmuscle.recording import Recording

BENCH = BenchLimits(ValidityRange(50e3, 500e3, 0.0, 0.25), 400.0)


def law():
    return TonduLopez2000(Braid(0.01, 0.4363, 0.3), 1.25)


def test_a_line_is_measured_at_its_ends():
    x = np.linspace(-1.0, 1.0, 9)
    information = np.array([np.outer(row, row) for row in np.column_stack([np.ones(9), x])])
    chosen = _select_runs(information, 4)
    assert sorted(chosen) == [0, 0, 8, 8]


def test_the_exchange_finds_the_best_of_all_designs():
    rng = np.random.default_rng(4)
    designs = rng.standard_normal((8, 3, 3))
    information = np.einsum("rij,rik->rjk", designs, designs)
    best = max(
        _log_determinant(information, c)
        for c in itertools.combinations_with_replacement(range(8), 3)
    )
    assert _log_determinant(information, _select_runs(information, 3)) == pytest.approx(
        best, abs=1e-6
    )


def test_every_candidate_stays_within_the_bench():
    found = candidate_runs(law(), BENCH, 12)
    assert {run.constant for run in found} == {"pressure", "contraction"}
    for run in found:
        assert run.pressure.min() >= 50e3 - 1e-6
        assert run.pressure.max() <= 500e3 + 1e-6
        assert run.contraction.min() >= -1e-12
        assert run.contraction.max() <= 0.25 + 1e-12
        assert run.force.max() <= 400.0
        assert run.force.min() > 0.0
        np.testing.assert_allclose(run.force, law().force(run.pressure, run.contraction))


def test_the_deviations_are_those_that_a_fit_then_has():
    """Measured as planned with readings of 2 N, the fit states what the plan promised, to 15 %."""
    free = optimal_design(law(), BENCH, runs=6, points=20, sigma=2.0, fixed=("geometry.radius",))
    points = free.recording()
    rng = np.random.default_rng(2)
    columns = {"pressure": points["pressure"], "contraction": points["contraction"]}
    columns["force"] = points["force"] + 2.0 * rng.standard_normal(len(points))
    found = fit(law(), Recording(columns, "bench"), fixed=("geometry.radius",))
    assert found.names == free.names
    np.testing.assert_allclose(found.standard_errors, free.standard_errors, rtol=0.15)


def test_the_plan_tells_more_than_runs_spread_evenly():
    assert (
        optimal_design(law(), BENCH, runs=4, fixed=("geometry.radius",)).relative_d_efficiency > 1.1
    )


def test_what_the_runs_cannot_tell_is_named():
    """Radius, angle, end correction: F is linear in r0^2, so all three are told; a single isobar at
    rest is not it.
    """
    found = optimal_design(law(), BENCH, runs=3)
    assert found.undetermined == ()
    tight = BenchLimits(ValidityRange(50e3, 500e3, 0.0, 1e-9), 5000.0)
    assert optimal_design(law(), tight, runs=3).undetermined != ()


def test_a_bench_that_can_do_nothing_is_refused():
    with pytest.raises(IdentificationError, match="gives no force between 0 and 1e-06 N"):
        optimal_design(law(), BenchLimits(ValidityRange(50e3, 500e3, 0.0, 0.25), 1e-6))
    with pytest.raises(ParameterError, match="runs is 0; it must be at least 1"):
        optimal_design(law(), BENCH, runs=0)
    with pytest.raises(ParameterError, match="sigma is inf; it must be positive and finite"):
        optimal_design(law(), BENCH, sigma=float("inf"))
    with pytest.raises(ParameterError, match="min_pressure"):
        BenchLimits(ValidityRange(5e5, 5e4, 0.0, 0.25), 100.0)


ARGUMENTS = [
    "plan",
    "tondu-lopez",
    "--max-pressure",
    "5 bar",
    "--max-force",
    "400 N",
    "--runs",
    "4",
]


def test_the_command_prints_a_table_and_writes_points_to_follow(tmp_path):
    done = airmuscle(*ARGUMENTS, "--out", tmp_path / "bench")
    assert done.exit_code == 0, done.output
    assert "expected force" in done.output
    points = read_csv(tmp_path / "bench" / "plan.csv")
    assert set(points["run"]) == {1.0, 2.0, 3.0, 4.0}
    assert points["force"].max() <= 400.0
    assert points["pressure"].max() <= 5e5 + 1e-6


def test_the_command_prints_json():
    done = airmuscle(*ARGUMENTS, "--json")
    found = json.loads(done.output)
    assert len(found["plan"]["runs"]) == 4
    assert found["plan"]["relative_D_efficiency"] > 1.0
    assert found["plan"]["units"]["runs.pressure"] == "Pa"


def test_a_limit_without_its_unit_is_one_line():
    done = airmuscle("plan", "tondu-lopez", "--max-pressure", "5", "--max-force", "400 N")
    assert done.exit_code == 1
    assert "has no unit" in done.output


def test_no_point_is_proposed_where_nothing_pulls():
    """Below 2 % of the greatest pressure, or below 1 % of the greatest force."""
    from_zero = BenchLimits(ValidityRange(287.0, 500e3, 0.0, 0.25), 400.0)
    law = TonduLopez2000(Braid(0.01, 0.44, 0.3), 1.1)
    runs = candidate_runs(law, from_zero, 15)
    forces = np.concatenate([run.force for run in runs])
    assert min(float(run.pressure.min()) for run in runs) >= 10e3
    assert float(forces.min()) >= 0.01 * float(forces.max())


def test_no_point_is_proposed_beyond_the_place_where_the_pull_of_a_surface_ends():
    """A polynomial that is slack from 83 to 217 kPa rises to 50 N below; the muscle stays slack
    there.
    """
    surface = ContractileSurface(
        (50.0, 0.0, 0.0, 250.0, 0.0, 250.0), 0.0, 600e3, 0.0, 0.2, degree=2
    )
    assert surface.force(0.0, 0.1) == pytest.approx(50.0)
    assert surface.force(150e3, 0.1) == 0.0
    runs = candidate_runs(surface, BenchLimits(ValidityRange(0.0, 600e3, 0.0, 0.2), 600.0), 12)
    assert 217e3 < min(run.pressure.min() for run in runs) < 240e3
