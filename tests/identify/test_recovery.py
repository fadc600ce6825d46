"""What made the data comes back from noisy data within the bands that the fit states, for every law
of the library.

Each characteristic of the library that has parameters makes points on its own validity range with
noise; the fit starts elsewhere. Tables have no parameters, and are refused. The force (or what the
law gives) must be held by its 99.9 % bands, and parameters that the data determine by their
standard deviations.
"""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from airmuscle import files
from airmuscle.bench import UNCENSORED, confidence_band, fit, weakly_determined
from airmuscle.bench.statics import fitted_quantity_of
from airmuscle.core import tree
from airmuscle.errors import AirmuscleWarning, IdentificationError
from airmuscle.files import library
from airmuscle.physics import Clamped, ContractionLaw, ForceLaw, Tabulated, ValidityRange
from airmuscle.recording import Recording

HELD = {
    "saga2007": ("wall_thickness",),  # multiplies the modulus: only their product is felt
    "saga2007-circle": ("wall_thickness",),
    "saga2007-exact": ("wall_thickness",),
}
LEAST_CONTRACTION = {"saga2007-exact": 0.04}
"""Below it the rubber at rest would draw the tube in below its end rings, of which that law says
nothing.
"""


def law_of(name: str):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        entry = library.load(name)
    law = entry.characteristic
    most = min(6e5, law.pressure_range[1])
    return law, entry.validity_range or ValidityRange(1e5, most, 0.0, 0.2)


def recoverable() -> list[str]:
    return [
        n
        for n in files.list_laws()
        if any(leaf.declared.fitted for leaf in tree.leaves(law_of(n)[0]))
    ]


def simulated(
    law, validity_range: ValidityRange, seed: int, least: float = -0.02
) -> tuple[Recording, Recording, float]:
    """Noisy points, the same points without noise, and the noise: 0.5 % of the range of what the
    law gives.
    """
    random = np.random.default_rng(seed)
    low = max(validity_range.contraction[0], least)
    high = validity_range.contraction[1]
    pressure = random.uniform(*validity_range.pressure, 400)
    direction = fitted_quantity_of(law)
    if isinstance(law, ForceLaw):
        contraction = random.uniform(low, high, 400)
        columns = {
            "pressure": pressure,
            "contraction": contraction,
            "force": law.unclamped_force(pressure, contraction),
        }
    elif isinstance(law, ContractionLaw):
        force = random.uniform(*law.force_range, 400)
        columns = {
            "pressure": pressure,
            "force": force,
            "contraction": law.contraction(pressure, force),
        }
    else:
        contraction = random.uniform(low, high, 400)
        force = random.uniform(0.0, 60.0, 400)
        columns = {
            "contraction": contraction,
            "force": force,
            "pressure": law.pressure(contraction, force),
        }
        inside = (columns["pressure"] > 0) & (columns["pressure"] < 8e5)
        columns = {key: values[inside] for key, values in columns.items()}
    exact = Recording(columns, "simulated")
    truth = exact[direction.name]
    noise = 0.005 * float(np.ptp(truth))
    noisy = truth + noise * random.standard_normal(len(exact))
    return exact.with_columns(**{direction.name: noisy}), exact, noise


def disturbed(law, fixed: tuple[str, ...]):
    """Start values 2 % away, within bounds."""
    values = []
    for i, leaf in enumerate(tree.leaves(law)):
        free = leaf.declared.fitted and leaf.path.partition("[")[0] not in fixed
        value = leaf.value * (1 + 0.02 * (-1) ** i) if free else leaf.value
        values.append(float(np.clip(value, *leaf.declared.bounds)))
    return tree.with_parameters(law, values)


@pytest.mark.parametrize("name", recoverable())
def test_a_law_is_recovered_within_its_bands(name: str):
    law, validity_range = law_of(name)
    inner = law.inner if isinstance(law, Clamped) else law
    fixed = HELD.get(name, ())
    noisy, exact, noise = simulated(inner, validity_range, 7, LEAST_CONTRACTION.get(name, -0.02))
    found = fit(disturbed(inner, fixed), noisy, censoring=UNCENSORED, fixed=fixed)
    assert found.sigma == pytest.approx(noise, rel=0.15)
    stated = confidence_band(found, exact, level=0.999)
    truth = exact[found.fitted_quantity.name]
    held = (stated.low <= truth) & (truth <= stated.high)
    assert held.mean() > 0.97
    assert np.sqrt(np.mean((stated.value - truth) ** 2)) < 0.5 * noise
    true = {leaf.path: leaf.value for leaf in tree.leaves(inner)}
    loose = weakly_determined(found)
    for estimate in found.estimates:
        if not estimate.on_bound and estimate.name not in loose:
            assert abs(estimate.value - true[estimate.name]) < 4.5 * estimate.stderr, estimate.name


def test_every_law_of_the_library_is_tried_and_a_table_has_nothing_to_find():
    tables = {name for name in files.list_laws() if isinstance(law_of(name)[0], Tabulated)}
    assert set(recoverable()) | tables == set(files.list_laws())
    assert tables == {"festo-tool-dmsp-10", "festo-tool-dmsp-20", "festo-tool-dmsp-40"}
    for name in tables:
        law, validity_range = law_of(name)
        with pytest.raises(IdentificationError, match="cannot be fitted"):
            fit(law, simulated(law, validity_range, 7)[1])
