"""Many plants side by side rest where each of them rests alone: the same one of several rests, to
the last digits, and none where there is none. What is out of the ordinary is asked alone, and
whoever stands beside it does not matter.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bumpy import Bumpy
from joints import chosen_muscle
from plants import BRAID, EXAMPLES, TWO_VALVES, of, pulled

from airmuscle.core import ops, tree
from airmuscle.engine import ZERO_INPUT, RungeKutta4, simulate_batch
from airmuscle.engine.compile import compile_system
from airmuscle.errors import AirmuscleError, EquilibriumError, ParameterError
from airmuscle.physics import (
    Ambient,
    AntagonisticJoint,
    Braid,
    ClosedChamber,
    FillDischarge,
    HangingMass,
    HuntCrossley,
    Isometric,
    JointWithEndStops,
    Lever,
    LinearSpring,
    MartensBoblan2017,
    MusclesInSeries,
    Plant,
    Polytropic,
    ProportionalRegulator,
    SeriesSpring,
    SpringLoad,
    Supply,
    Tube,
    Valve,
    VirtualWork,
    ViscoelasticWall,
    WithTubes,
    find_equilibria,
    find_equilibrium,
    find_equilibrium_of_each,
)
from airmuscle.physics.equilibrium.single_dof import grid
from airmuscle.physics.equilibrium.statics import Statics

SPREAD = 0.05
FAST = RungeKutta4(1e-3)
JOINT = pulled(AntagonisticJoint(0.03, 0.05, 0.2, 2.0, 0.12), 2)
OTHERS = {
    "a joint that falls to a stop on either side": pulled(
        JointWithEndStops(
            AntagonisticJoint(0.03, 0.05, 0.2, -60.0, 0.12), -0.4, 0.2, 0.05, HuntCrossley(1e8)
        ),
        2,
    ),
    "two muscles on a lever": pulled(Lever((0.05, -0.05), 2.0, 0.3, 0.01, 0.1, (0.1, 0.1)), 2),
    "series springs on a joint": Plant(
        tuple(
            replace(chosen_muscle(), name=n, series=SeriesSpring(5e4)) for n in ("left", "right")
        ),
        (TWO_VALVES, TWO_VALVES),
        JOINT.mechanism,
        Polytropic(1.2),
    ),
    "series spring and wall, held": Plant(
        replace(chosen_muscle(), series=SeriesSpring(5e4), wall=ViscoelasticWall(1e-12, 0.05)),
        TWO_VALVES,
        Isometric(0.1),
    ),
    "no load on a spring": pulled(SpringLoad(5.0, 2000.0)),
}


def one_way(plant):
    return len(plant.mechanism.coordinates) < 2


PLANTS = {name: plant for name, plant in {**EXAMPLES, **OTHERS}.items() if one_way(plant)}


def varied(plant, count):
    """All parameters (N, P) of plants around one, each within its bounds."""
    draw = np.random.default_rng(4)
    columns = []
    for leaf in tree.leaves(plant):
        values = leaf.value * (1 + SPREAD * draw.uniform(-1, 1, count))
        columns.append(np.clip(values, *leaf.declared.bounds))
    return np.column_stack(columns)


def found(plant, parameters, pressure, inputs=None):
    pressures = pressure if isinstance(pressure, tuple) else (pressure,) * len(plant.muscles)
    given_inputs = np.zeros(len(plant.inputs)) if inputs is None else inputs
    return find_equilibrium_of_each(compile_system(plant), parameters, pressures, given_inputs)


def one_by_one(plant, pressure):
    """The stable equilibrium nearest to full length of one plant alone, from `find_equilibria`;
    None without one.
    """
    try:
        stable = [rest.state for rest in find_equilibria(plant, pressure=pressure) if rest.stable]
    except AirmuscleError:
        return None
    return min(stable, key=lambda state: squared_contractions(plant, state)) if stable else None


def squared_contractions(plant, state):
    columns = plant.outputs(state, dict.fromkeys(plant.inputs, 0.0))
    return sum(columns[f"{prefix}contraction"] ** 2 for prefix in plant.prefixes)


def acceleration_of(plant, state):
    """The greatest acceleration of the compiled plant, which the search does not use, in units of
    its rates.
    """
    rates = dict(
        zip(
            (s.name for s in plant.states),
            compile_system(plant).rates(list(state), [0.0] * len(plant.inputs)),
            strict=True,
        )
    )
    return max((abs(rates[c.speed]) for c in plant.mechanism.coordinates), default=0.0)


def as_alone(plant, parameters, pressure):
    """Assert that every plant of a table has the equilibrium that it has alone; the number that
    have one, and states.
    """
    of_each = found(plant, parameters, pressure)
    count = 0
    for row, state in zip(parameters, of_each, strict=True):
        one = tree.with_parameters(plant, row.tolist())
        expected = one_by_one(one, pressure)
        assert (expected is None) == bool(np.isnan(state).any())
        if expected is not None:
            count += 1
            if not isinstance(pressure, tuple):
                assert acceleration_of(one, state) < 1e-5
            difference = [
                (x - expected[s.name]) / s.nominal for x, s in zip(state, one.states, strict=True)
            ]
            np.testing.assert_allclose(difference, 0.0, atol=1e-11)
    return count, of_each


@pytest.mark.parametrize("name", PLANTS)
def test_every_plant_rests_where_it_does_alone(name):
    """Of all kinds of components; at 2 bar nearly all have a rest, and none had to be asked
    alone.
    """
    plant = PLANTS[name]
    count, _ = as_alone(plant, varied(plant, 3), 2e5)
    if name != "prescribed":  # rests wherever it is, which is said alone
        assert count >= (0 if name == "chou-hannaford" else 1)


@pytest.mark.parametrize(
    "name", [*OTHERS, "mass on a spring", "pulley with stops", "Catenary", "held for good", "lever"]
)
def test_so_it_does_at_ambient_pressure_and_below(name):
    plant = PLANTS[name]
    for pressure in (0.0, -3e4):
        as_alone(plant, varied(plant, 3), pressure)


def test_of_several_rests_each_takes_its_own():
    """With its stops at -0.4 and 0.2 a joint that falls rests at the nearer one, and at either
    while it is turned.
    """
    plant = OTHERS["a joint that falls to a stop on either side"]
    paths = [leaf.path for leaf in tree.leaves(plant)]
    table = np.repeat(tree.flatten(plant)[None, :], 3, axis=0)
    ends = ("mechanism.lower_stop", "mechanism.upper_stop")
    table[1, [paths.index(end) for end in ends]] = -0.2, 0.4
    table[2, [paths.index(end) for end in ends]] = -0.4, 0.39
    angle = [s.name for s in plant.states].index("angle")
    states = found(plant, table, 2e5)
    np.testing.assert_allclose(states[:, angle], [0.2, -0.2, 0.39], atol=0.02)
    as_alone(plant, table, 2e5)


def test_pressures_may_differ_from_muscle_to_muscle_and_inputs_be_given():
    plant = JOINT
    as_alone(plant, varied(plant, 3), (1e5, 3e5))
    held = EXAMPLES["held and let go"]
    table = varied(held, 2)
    free, shut = (found(held, table, 2e5, np.array([0.0, 0.0, latch])) for latch in (0.0, 1.0))
    assert np.isfinite(free).all()
    assert np.isnan(
        shut
    ).all()  # in equilibrium everywhere, which `find_equilibrium` reports of one plant


@pytest.mark.parametrize(
    "name", ["polytropic", "series spring with a stop", "lever", "joint with stops", "surface"]
)
def test_neighbours_do_not_matter_to_the_last_digit(name):
    """Powers of arrays and of numbers may differ in their last digit; the rest of a plant must
    not.
    """
    plant = PLANTS[name]
    table = varied(plant, 9)
    together = found(plant, table, 2e5)
    for i in (0, 4, 8):
        row = table[i]
        np.testing.assert_array_equal(found(plant, row[None, :], 2e5)[0], together[i])
        alone = find_equilibrium(tree.with_parameters(plant, row.tolist()), pressure=2e5)
        assert list(alone.values()) == together[i].tolist()
    np.testing.assert_array_equal(found(plant, table[3:7], 2e5), together[3:7])


def test_more_plants_than_go_side_by_side_are_taken_in_blocks(monkeypatch):
    import sys

    plant = JOINT
    table = varied(plant, 7)
    together = found(plant, table, 2e5)
    module = sys.modules["airmuscle.physics.equilibrium.equilibrium"]
    monkeypatch.setattr(module, "TABLE_SIZE", 3 * module.GRID_POINTS * len(plant.states))
    np.testing.assert_array_equal(found(plant, table, 2e5), together)
    assert np.isfinite(together).all()


# Rests that are easily missed


def of_mechanism(mechanism, rows):
    """A plant, and a table of such plants with these parameters of its mechanism."""
    plant = Plant(chosen_muscle(), ClosedChamber(), mechanism, Polytropic(1.2))
    table = np.repeat(tree.flatten(plant)[None, :], len(rows), axis=0)
    places = [i for i, leaf in enumerate(tree.leaves(plant)) if leaf.path.startswith("mechanism")]
    table[:, places] = rows
    return plant, table


def test_pairs_of_rests_are_found_however_close_and_none_is_made_up():
    rows = [(0.02, 2e-2), (0.03, 1e-5), (0.011, 1e-7), (0.025, 1e-3)]
    plant, table = of_mechanism(Bumpy(*rows[0]), rows)
    position = found(plant, table, 1e5)[:, 1]
    np.testing.assert_allclose(position, [a - d for a, d in rows], atol=1e-10)

    class Above(Bumpy):
        def acceleration(self, q, v, pulls, inputs):
            return {"position": (q["position"] - self.middle) ** 2 + self.half**2}

    plant, table = of_mechanism(Above(0.02, 1e-4), rows)
    assert np.isnan(found(plant, table, 1e5)).all()


def test_of_a_stretch_in_balance_the_nearer_end_is_taken():
    class Flat(Bumpy):
        def acceleration(self, q, v, pulls, inputs):
            x = q["position"] - self.middle
            return {"position": ops.maximum(-self.half - x, 0.0) - ops.maximum(x - self.half, 0.0)}

    plant, table = of_mechanism(Flat(0.02, 0.015), [(0.02, 0.015), (0.03, 0.011)])
    assert as_alone(plant, table, 1e5)[0] == 2
    np.testing.assert_allclose(found(plant, table, 1e5)[:, 1], [0.005, 0.019], atol=2e-3)


def test_a_pole_is_no_rest():
    """A law whose braid straightens within the muscle's reach passes from one sign to the other
    through infinity.
    """
    law = MartensBoblan2017(Braid(0.0103, 0.39, 0.3), 0.0019, 9.4e7, -7.4e8, 1.6e9, -4.9e8)
    plant = of(law, Braid(0.01, 0.4363, 0.2), spring=LinearSpring(3000.0))
    rests = find_equilibria(plant, pressure=1e5)
    assert rests
    ready = compile_system(plant)
    for rest in rests:
        assert np.abs(ready.rates(list(rest.state.values()), [0.0, 0.0])).max() < 1e-6
    as_alone(plant, varied(plant, 3), 1e5)


@pytest.mark.parametrize(
    "name", ["lever", "two muscles on a lever", "joint with stops", "mass on a spring"]
)
def test_they_are_looked_at_in_the_same_places(name):
    """Ends of the reach and all, whether contractions are straight lines over the coordinate or
    not.
    """
    plant = PLANTS[name]
    table = varied(plant, 4)
    ready = compile_system(plant)
    pressures = (0.0,) * len(plant.muscles)
    inputs = np.zeros(len(plant.inputs))
    for row, x in zip(table, grid(Statics.of_plants(ready, table, pressures, inputs)), strict=True):
        (alone,) = grid(Statics.of_plants(ready, row[None], pressures, inputs))
        np.testing.assert_allclose(
            x[np.isfinite(x)], alone[np.isfinite(alone)], rtol=0.0, atol=1e-15
        )


# What is evaluated one by one


def test_plants_of_several_coordinates_have_the_equilibria_that_each_has_alone():
    plant = pulled(MusclesInSeries(HangingMass(10.0), (0.5,)), 2)
    assert as_alone(plant, varied(plant, 3), 3e5)[0] == 3
    batch = simulate_batch(
        pulled(MusclesInSeries(HangingMass(1.0), (0.05,)), 2),
        {"mechanism.inner.mass": [1.0, 1.1]},
        ZERO_INPUT,
        duration=2e-3,
        integrator=FAST,
    )
    for i in range(2):
        alone = find_equilibrium(batch.plant(i), pressure=0.0)
        np.testing.assert_allclose(batch["position"][i, 0], alone["position"], rtol=1e-12)


def test_a_law_that_takes_no_arrays_is_evaluated_one_by_one():
    class Numbers(SpringLoad):
        def contractions(self, q, resting_lengths):
            if isinstance(q["position"], np.ndarray):
                raise TypeError("only numbers")
            return super().contractions(q, resting_lengths)

    plant = pulled(Numbers(5.0, 2000.0, 1.0, 50.0))
    table = varied(plant, 2)
    usual = found(pulled(SpringLoad(5.0, 2000.0, 1.0, 50.0)), table, 2e5)
    np.testing.assert_allclose(found(plant, table, 2e5), usual, rtol=1e-11, atol=1e-15)
    for row, state in zip(table, usual, strict=True):
        alone = find_equilibrium(tree.with_parameters(plant, row.tolist()), pressure=2e5)
        np.testing.assert_allclose(list(alone.values()), state, rtol=1e-11, atol=1e-15)


def test_a_plant_beyond_its_reach_or_in_a_vacuum_has_no_equilibrium_and_its_neighbours_have():
    plant = pulled(Isometric(0.05))
    paths = [leaf.path for leaf in tree.leaves(plant)]
    table = np.repeat(tree.flatten(plant)[None, :], 3, axis=0)
    table[1, paths.index("mechanism.contraction")] = -0.2
    assert np.isfinite(found(plant, table, 1e5)).all(axis=1).tolist() == [True, False, True]
    for one in (plant, pulled(SpringLoad(5.0, 2000.0, 1.0, -200.0))):
        paths = [leaf.path for leaf in tree.leaves(one)]
        table = np.repeat(tree.flatten(one)[None, :], 2, axis=0)
        table[0, paths.index("ambient.pressure")] = 5e4
        of_each = found(one, table, -6e4)
        assert np.isfinite(of_each).all(axis=1).tolist() == [False, True]
        with pytest.raises(ParameterError, match="not above absolute vacuum"):
            find_equilibrium(replace(one, ambient=Ambient(5e4)), pressure=-6e4)


def test_a_plant_whose_input_is_out_of_range_has_no_equilibrium():
    regulator = ProportionalRegulator(
        Supply(6e5),
        Valve(1e-8, 0.3),
        Valve(1e-8, 0.3),
        EXAMPLES["regulator, leak"].circuit.circuit.lag,
    )
    plant = Plant(chosen_muscle(), regulator, Isometric(0.05))
    paths = [leaf.path for leaf in tree.leaves(plant)]
    table = np.repeat(tree.flatten(plant)[None, :], 2, axis=0)
    table[0, paths.index("circuit.max_setpoint")] = 1e5
    assert np.isfinite(found(plant, table, 1e5, np.array([2e5]))).all(axis=1).tolist() == [
        False,
        True,
    ]


# The starts of a batch


def starts_of(plant, variations):
    """Where the plants of a batch begin, by state (N,), and why some do not."""
    batch = simulate_batch(plant, variations, ZERO_INPUT, duration=1e-3, integrator=FAST)
    return {s.name: batch[s.name][:, 0] for s in plant.states}, batch


@pytest.mark.slow
def test_a_batch_begins_at_rest_and_says_of_each_that_has_none_what_is_said_alone():
    plant = of(spring=LinearSpring(8000.0))
    masses = [4.0, 500.0, 5.0, 600.0]
    start, batch = starts_of(plant, {"mechanism.mass": masses})
    for i, mass in enumerate(masses):
        alone = replace(plant, mechanism=HangingMass(mass))
        if mass < 100.0:
            assert {name: column[i] for name, column in start.items()} == find_equilibrium(
                alone, pressure=0.0
            )
        else:
            with pytest.raises(EquilibriumError) as said:
                find_equilibrium(alone, pressure=0.0)
            assert batch.reason(i) == f"it has no equilibrium to start from: {said.value}"


def test_what_a_circuit_holds_at_rest_is_its_own():
    """A tube twice as large holds twice the air: plants that differ in it alone do not share their
    start.
    """
    plant = Plant(
        chosen_muscle(), WithTubes(TWO_VALVES, Tube(Valve(1e-8, 0.3), 1e-5)), HangingMass(1.0)
    )
    start, _ = starts_of(plant, {"circuit.tube.volume": [1e-5, 2e-5]})
    (name,) = [n for n in start if "tube" in n]
    assert start[name][1] == pytest.approx(2.0 * start[name][0], rel=1e-12)
    assert start["position"][0] == start["position"][1]


def test_the_example_of_the_batch_begins_where_it_rests():
    """Some hundred plants of every parameter different: all at rest, none asked alone."""
    plant = of(VirtualWork(BRAID), spring=LinearSpring(8000.0))
    table = varied(replace(plant, mechanism=HangingMass(3.0)), 200)
    of_each = found(plant, table, 0.0)
    assert np.isfinite(of_each).all()
    rates = [
        compile_system(tree.with_parameters(plant, row.tolist())).rates(state, [0.0, 0.0])
        for row, state in zip(table[::20], of_each[::20], strict=True)
    ]
    assert np.abs(np.array(rates)[:, 1:]).max() < 1e-9


def test_fill_discharge_alone_is_shared():
    circuit = FillDischarge(Supply(5e5), Valve(1e-8, 0.4), Valve(3e-9, 0.2))
    plant = Plant(chosen_muscle(), circuit, HangingMass(1.0))
    start, _ = starts_of(
        plant, {"circuit.fill.conductance": [1e-8, 2e-8], "mechanism.mass": [1.0, 1.0]}
    )
    assert all(column[0] == column[1] for column in start.values())
