"""Equal parts of a plant are printed as one function that is called for each of them.

Law: a function that is called for each part computes what the same instructions compute in a row,
but for the rounding of sums in another order. The text grows with the number of parts by little
more than their calls. Opponent: the module without calls.
"""

from __future__ import annotations

import ctypes
from dataclasses import replace

import numpy as np
import pytest
from filling import hanging
from plants import EXAMPLES
from widths import widened

from airmuscle.core import tree
from airmuscle.engine.compile import functions, program
from airmuscle.engine.compile.ir import repeated_parts
from airmuscle.engine.compile.llvm import emit
from airmuscle.physics import HangingMass

COUNT = 3
"""Equal muscles of a plant, and the least number of equal parts, in the tests of all laws."""
BY_DEFAULT = {"surface", "tondu-lopez", "circle", "Maxwell slip", "heat", "real gas"}
ROUNDING = 1e-15
ROUNDING_OF_DERIVATIVES = 1e-13
"""Relative to the largest value of a column. Some derivatives are differences of greater numbers:
of an outline by a parabola, two hundred times as great."""


def side_by_side(plant, count=COUNT):
    """So many of the first muscle of a plant, with its circuit, on one mass."""
    muscles = tuple(replace(plant.muscles[0], name=f"m{i}") for i in range(count))
    circuits = (plant.circuits[0],) * count
    return replace(plant, muscle=muscles, circuit=circuits, mechanism=HangingMass(5.0 * count))


class Compiled:
    """The functions of a system with or without calls, at states and inputs drawn at random."""

    def __init__(self, system, least_count):
        self.text, self.sizes = functions.system_module(
            functions.trace_system(system), least_count=least_count
        )
        self.module = program.Module(self.text, self.sizes.held)
        self.constants = self.module.prepare(tree.flatten(system))
        self.nominal = np.array([state.nominal for state in system.states])

    def call(self, name, *arrays):
        kinds = [ctypes.c_double if isinstance(a, float) else ctypes.c_void_p for a in arrays]
        values = [a if isinstance(a, float) else a.ctypes.data for a in arrays]
        ctypes.CFUNCTYPE(None, *kinds)(self.module.address(name))(*values)

    def values(self):
        """The results of all functions by name, a row for each point."""
        rng = np.random.default_rng(3)
        sizes = self.sizes
        rows = []
        for _ in range(40):
            x = self.nominal * rng.uniform(0.02, 2.0, sizes.states)
            u = rng.integers(0, 2, sizes.inputs).astype(float)
            lengths = {
                "f": sizes.states,
                "o": sizes.outputs,
                "J": sizes.jacobian,
                "A": sizes.factors,
                "k": sizes.states,
                "df": sizes.states,
            }
            row = {name: np.zeros(length) for name, length in lengths.items()}
            c = self.constants
            self.call("rhs", x, u, c, row["f"])
            self.call("outputs", x, u, c, row["o"])
            self.call("jac", x, u, c, np.zeros(sizes.states), row["J"])
            self.call("factor", row["J"], 2e4, row["A"])
            self.call("stage", x, u, c, row["A"], np.ones(sizes.states), row["k"])
            self.call("df_dt", x, u, c, np.ones(sizes.inputs), row["df"])
            rows.append(row)
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def assert_equal(system, least_count):
    """Both forms of a system compute the same; the one with calls has some."""
    called = Compiled(system, least_count)
    straight = Compiled(system, None)
    assert part_functions(called.text)
    assert not part_functions(straight.text)
    values = called.values()
    for name, expected in straight.values().items():
        tolerance = ROUNDING if name in ("f", "o") else ROUNDING_OF_DERIVATIVES
        size = np.abs(np.where(np.isfinite(expected), expected, 0.0)).max(axis=0)
        assert np.array_equal(np.isfinite(values[name]), np.isfinite(expected)), name
        with np.errstate(invalid="ignore"):
            assert not (np.abs(values[name] - expected) > tolerance * size).any(), name


def part_functions(text):
    """The names of the functions of parts."""
    lines = [line for line in text.splitlines() if line.startswith("define") and "@part" in line]
    return [line.split("@")[1].split("(")[0] for line in lines]


@pytest.mark.parametrize("name", widened(EXAMPLES, BY_DEFAULT.__contains__))
def test_a_part_that_is_called_computes_what_it_computes_in_a_row(name):
    assert_equal(side_by_side(EXAMPLES[name]), COUNT)


def module_text(count):
    """The module of so many muscles, with springs of different stiffness."""
    return functions.system_module(functions.trace_system(hanging(count)))[0]


def test_each_function_calls_one_function_of_a_muscle():
    """The Jacobian has up to three, which differ in the sums that they take part in."""
    least = repeated_parts.LEAST_COUNT
    some = module_text(least)
    more = module_text(least + 4)
    assert 5 <= len(part_functions(some)) <= 8
    assert 5 <= len(part_functions(more)) <= 8
    of_a_further_muscle = (more.count("\n") - some.count("\n")) / 4
    assert of_a_further_muscle < 0.2 * module_text(1).count("\n")


def test_few_muscles_are_computed_without_calls():
    text = module_text(repeated_parts.LEAST_COUNT - 1)
    after_preparation = text.split("@rhs(")[1]
    assert "@part" not in after_preparation


def test_a_call_with_an_address_of_another_part_is_found(monkeypatch):
    plain = emit.FunctionBody.call_part

    def shifted(self, name, addresses, values, count):
        last = self.put(f"getelementptr inbounds double, ptr {addresses[-1]}, i64 1")
        return plain(self, name, [*addresses[:-1], last], values, count)

    monkeypatch.setattr(emit.FunctionBody, "call_part", shifted)
    with pytest.raises(AssertionError):
        assert_equal(side_by_side(EXAMPLES["surface"]), COUNT)
