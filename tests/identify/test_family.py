"""One characteristic serves muscles of one type and different length: their ends take part as a
fixed piece does.

What made the data of several lengths comes back from all of them together, and then speaks of a
length that was never measured; a law that knows of no lengths does neither.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from widths import widened

from airmuscle.bench import Candidate, SpecimenSplit, compare, fit, standard_candidates
from airmuscle.bench.statics import blank_surface
from airmuscle.errors import IdentificationError, ParameterError
from airmuscle.files import Entry, to_toml
from airmuscle.files.library import Location
from airmuscle.files.library.build import build
from airmuscle.physics import (
    Braid,
    ContractileSurface,
    EffectiveLength,
    InverseLength,
    LogarithmicLength,
    TonduLopez2000,
)
from airmuscle.recording import Recording

LENGTHS = (0.08, 0.12, 0.2, 0.4)
MIDDLE = ContractileSurface(
    (400.0, -300.0, 260.0, 40.0, -120.0, 10.0), 0.0, 6e5, 0.0, 0.2, -1e6, 1e6, 2
)
CHANGE = ContractileSurface((-60.0, 30.0, -50.0), 0.0, 6e5, 0.0, 0.2, -1e6, 1e6, 1)
TRUTHS = (
    EffectiveLength(MIDDLE, 0.2, 0.02, 0.001),
    InverseLength(MIDDLE, CHANGE, 0.2, 0.2),
    LogarithmicLength(MIDDLE, CHANGE, 0.2, 0.2),
)


def measured(law, length: float, *, noise: float = 0.0, seed: int = 1) -> Recording:
    random = np.random.default_rng(seed + int(length * 1e3))
    pressure = random.uniform(3e5, 6e5, 200)
    contraction = random.uniform(0.0, 0.12, 200)
    force = law.with_resting_length(length).unclamped_force(
        pressure, contraction
    ) + noise * random.standard_normal(200)
    columns = {"pressure": pressure, "contraction": contraction, "force": force}
    return Recording(columns, f"{length * 1e3:.0f} mm", {"resting_length": length})


def blank(truth):
    """The law with nothing known of it."""
    if isinstance(truth, EffectiveLength):
        return EffectiveLength(blank_surface(2), 0.4, 0.005)
    return type(truth)(blank_surface(2), blank_surface(1), 0.4, 0.2)


@pytest.mark.parametrize("truth", TRUTHS, ids=lambda law: type(law).__name__)
def test_a_family_is_recovered_and_speaks_of_a_length_never_measured(truth):
    runs = [measured(truth, length) for length in LENGTHS if length != 0.12]
    found = fit(blank(truth), runs)
    unseen = measured(truth, 0.12)
    given = found.model.with_resting_length(0.12).unclamped_force(
        unseen["pressure"], unseen["contraction"]
    )
    assert given == pytest.approx(unseen["force"], abs=1e-4)
    if isinstance(truth, EffectiveLength):
        assert found["dead_length"].value == pytest.approx(0.02, abs=1e-7)
        assert found["end_shift"].value == pytest.approx(0.001, abs=1e-7)


@pytest.mark.parametrize(
    "truth",
    widened(TRUTHS, lambda law: not isinstance(law, LogarithmicLength)),
    ids=lambda law: type(law).__name__,
)
def test_the_law_of_lengths_is_chosen_by_leaving_specimens_out(truth):
    runs = [measured(truth, length, noise=2.0) for length in (*LENGTHS, 0.3)]
    candidates = [Candidate(type(t).__name__, blank(t)) for t in TRUTHS] + [
        Candidate("no length", blank_surface(2))
    ]
    found = compare(runs, candidates, leave_out=SpecimenSplit())
    assert found.ranking[0].candidate.name == type(truth).__name__
    assert found["no length"].cross_validated_rmse > 5 * found.ranking[0].cross_validated_rmse


def test_one_length_alone_does_not_determine_how_length_acts():
    with pytest.raises(IdentificationError, match="cannot separate"):
        fit(InverseLength(blank_surface(2), blank_surface(1), 0.2, 0.1), [measured(TRUTHS[1], 0.2)])


def test_a_dead_length_is_tondus_end_correction():
    """(eps L_0)/(L_0 - l_d) = k eps with k = L_0/(L_0 - l_d)."""
    braid = Braid(0.01, 0.45, 0.2)
    whole = TonduLopez2000(braid, 1.25)
    middle = EffectiveLength(TonduLopez2000(braid, 1.0), 0.2, 0.04)
    eps = np.linspace(-0.02, 0.2, 7)
    assert middle.force(5e5, eps) == pytest.approx(whole.force(5e5, eps), rel=1e-12)
    assert middle.with_resting_length(0.4).force(5e5, 0.1) > middle.force(5e5, 0.1)


def test_at_the_reference_length_the_inner_law_is_the_whole():
    for law in (TRUTHS[1], TRUTHS[2]):
        assert law.force(5e5, 0.05) == MIDDLE.force(5e5, 0.05)
        assert law.with_resting_length(0.1).force(5e5, 0.05) != MIDDLE.force(5e5, 0.05)
    doubled = dataclasses.replace(TRUTHS[1], resting_length=0.1).force(5e5, 0.05)
    assert doubled == pytest.approx(
        MIDDLE.force(5e5, 0.05) + CHANGE.unclamped_force(5e5, 0.05), rel=1e-12
    )


def test_families_are_tried_where_lengths_differ_and_only_there():
    several = [measured(TRUTHS[1], length) for length in LENGTHS]
    names = {type(c.law) for c in standard_candidates(several)}
    assert {EffectiveLength, InverseLength, LogarithmicLength} <= names
    assert EffectiveLength not in {type(c.law) for c in standard_candidates(several[:1])}


@pytest.mark.parametrize("truth", TRUTHS, ids=lambda law: type(law).__name__)
def test_a_family_is_written_and_read_back(truth, tmp_path):
    import tomllib

    table = tomllib.loads(to_toml(Entry("family", "family", "chosen", truth)))
    assert build(table["characteristic"], Location("family", "characteristic", tmp_path)) == truth


def test_a_dead_length_that_leaves_nothing_is_refused():
    with pytest.raises(ParameterError, match="dead_length"):
        EffectiveLength(MIDDLE, 0.1, 0.2)
