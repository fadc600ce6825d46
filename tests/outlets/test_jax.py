"""A plant inside the user's own JAX program: jit, vmap and grad work, and the numbers are NumPy's.

Rates are compared relative to their size or the size of their state in a second, whichever is
larger.
"""

from __future__ import annotations

import contextlib
import warnings
from dataclasses import replace

import numpy as np
import pytest
from joints import chosen_muscle

from airmuscle.core import tree
from airmuscle.errors import AirmuscleWarning, ParameterError, SolveError, TraceError
from airmuscle.files import list_laws, load
from airmuscle.physics import (
    CreepElements,
    EndStop,
    EnergyBalance,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    Isothermal,
    MaxwellSlip,
    Plant,
    Polytropic,
    SeriesSpring,
    Supply,
    Tank,
    Tube,
    Valve,
    ViscoelasticWall,
    WithLeak,
    WithTubes,
    find_equilibrium,
)

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)
pytestmark = pytest.mark.tool
jnp = jax.numpy

VALVE = Valve(2.6e-9, 0.43)
GASES = [Isothermal(), Polytropic(1.2), EnergyBalance(1.0)]
INPUTS = {"fill": 0.3, "discharge": 0.1}


def plant_of_everything(gas):
    muscle = replace(
        chosen_muscle(),
        friction=MaxwellSlip((4e4, 2e4), (2e-4, 1e-3)),
        wall=ViscoelasticWall(2e-11, 0.2),
        series=SeriesSpring(2e4),
        stop=EndStop(0.12, HuntCrossley(1e8)),
        creep=CreepElements((500.0,), (2.0,)),
    )
    valves = FillDischarge(Tank(Supply(5e5), Valve(3e-9, 0.3), 1e-3), VALVE, VALVE)
    circuit = WithLeak(WithTubes(valves, Tube(Valve(1e-8, 0.2), 2e-5, 3)), Valve(1e-12, 0.3))
    return Plant(muscle, circuit, HangingMass(10.0), gas)


def as_jax(values):
    return {name: jnp.asarray(value) for name, value in values.items()}


@pytest.mark.parametrize("gas", GASES, ids=repr)
def test_the_rates_under_jit_are_those_of_numpy(gas):
    plant = plant_of_everything(gas)
    state = find_equilibrium(plant, pressure=2e5)
    expected = plant.rates(state, INPUTS)
    found = jax.jit(plant.rates)(as_jax(state), as_jax(INPUTS))
    for variable in plant.states:
        size = abs(float(expected[variable.name])) + 100 * variable.nominal
        assert abs(float(found[variable.name]) - float(expected[variable.name])) < 1e-12 * size, (
            variable.name
        )


@pytest.mark.parametrize("gas", GASES, ids=repr)
def test_outputs_over_many_states_at_once_are_those_of_each(gas):
    plant = plant_of_everything(gas)
    state = find_equilibrium(plant, pressure=2e5)
    heights = np.linspace(0.9, 1.1, 7) * state["position"]
    forces = jax.vmap(
        lambda y: plant.outputs({**as_jax(state), "position": y}, as_jax(INPUTS))["force"]
    )(heights)
    each = [float(plant.outputs({**state, "position": float(y)}, INPUTS)["force"]) for y in heights]
    np.testing.assert_allclose(forces, each, rtol=1e-12, atol=1e-10)


def test_a_gradient_by_every_parameter_is_the_difference_quotient():
    plant = plant_of_everything(EnergyBalance(1.0))
    state = find_equilibrium(plant, pressure=2e5)
    leaves = tree.flatten(plant)

    def inflow(values):
        rates = tree.unflatten(plant, list(values)).rates(as_jax(state), as_jax(INPUTS))
        return 1e3 * rates["tube1.air_mass"] + rates["speed"]

    gradient = np.asarray(jax.jit(jax.grad(inflow))(jnp.asarray(leaves)))
    assert np.isfinite(gradient).all()
    for path in (
        "circuit.circuit.circuit.fill.conductance",
        "muscle.series.stiffness",
        "mechanism.mass",
    ):
        i = [leaf.path for leaf in tree.leaves(plant)].index(path)
        step = 1e-6 * leaves[i] * np.eye(leaves.size)[i]
        quotient = (inflow(leaves + step) - inflow(leaves - step)) / (2e-6 * leaves[i])
        assert gradient[i] == pytest.approx(float(quotient), rel=1e-6), path
        assert gradient[i] != 0.0


def test_single_precision_is_refused_by_equations():
    """Rates of a plant near rest were wrong by up to 63 %."""
    plant = plant_of_everything(EnergyBalance(1.0))
    state = find_equilibrium(plant, pressure=2e5)
    message = r"JAX array of the type float32; it must be float64.*jax_enable_x64"
    with pytest.raises(ParameterError, match=message):
        jax.jit(plant.rates)({name: jnp.float32(value) for name, value in state.items()}, INPUTS)
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(ParameterError, match=message):
            plant.outputs(as_jax(state), INPUTS)
        with pytest.raises(ParameterError, match=message):
            jax.jit(load("dmsp-20-300").muscle.contractile.force)(2e5, 0.1)
    finally:
        jax.config.update("jax_enable_x64", True)


@pytest.mark.parametrize("direction", ["contraction", "pressure", "force"])
@pytest.mark.parametrize("name", list_laws())
def test_a_direction_of_a_law_is_traced_or_refused(name: str, direction: str):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        entry = load(name)
    law = entry.characteristic
    arguments = {"contraction": (2e5, 100.0), "pressure": (0.1, 100.0), "force": (2e5, 0.1)}[
        direction
    ]
    with contextlib.suppress(TraceError):
        jax.jit(getattr(law, direction))(*arguments)


@pytest.mark.parametrize("name", list_laws())
def test_a_law_beyond_its_range_answers_arrays_of_jax_as_numbers(name: str):
    """In a traced program, which can neither search nor warn, other directions are NaN where they
    would have to search.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        law = load(name).characteristic
    if law.refuses_beyond:
        pytest.skip("the law refuses what lies beyond its range")
    answers = {"force": (9e5, -0.03), "contraction": (3e5, 700.0), "pressure": (-0.02, 400.0)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        for direction, point in answers.items():
            method = getattr(law, direction)
            expected = np.nan
            with contextlib.suppress(SolveError):
                expected = method(*point)
            found = np.nan
            with contextlib.suppress(SolveError):
                found = float(method(*map(jnp.asarray, point)))
            np.testing.assert_allclose(found, expected, rtol=1e-12)
            with contextlib.suppress(TraceError, SolveError):
                traced = float(jax.jit(method)(*point))
                is_searched = direction != "force" and np.isnan(traced)
                assert is_searched or traced == pytest.approx(expected, rel=1e-12)
        slopes = law.slopes(*map(jnp.asarray, answers["force"]))
        np.testing.assert_allclose(slopes, law.slopes(*answers["force"]), rtol=1e-9)
