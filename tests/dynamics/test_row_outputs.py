"""Outputs at several rows at once: the same numbers as one by one, whatever the number of rows."""

from __future__ import annotations

import dataclasses

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
from plants import EXAMPLES
from widths import widened

from airmuscle.engine import PiecewiseLinear
from airmuscle.engine.compile import compile_system
from airmuscle.engine.compile.functions_simd import ROWS
from airmuscle.engine.run.solution import RowRecorder
from airmuscle.physics import HangingMass

BY_DEFAULT = {
    "surface",
    "stand-in",
    "circle",
    "tondu-lopez",
    "sarosi",
    "Catenary",
    "stop, lagging wall",
    "Maxwell slip",
    "heat",
    "real gas",
    "polytropic",
    "Serres",
}
"""Laws with and without branches and functions of the C library."""
TOLERANCE = 1e-11
"""Rounding, relative to the largest value of a column: differences of forces lose digits."""


def points(compiled, count):
    """States and inputs at random, about the nominal sizes of the states."""
    rng = np.random.default_rng(5)
    sizes = compiled.sizes
    states = compiled.nominal * rng.uniform(0.02, 1.5, (count, sizes.states))
    return np.ascontiguousarray(states), rng.integers(0, 2, (count, sizes.inputs)).astype(float)


def in_rows(compiled, states, inputs):
    """Outputs by the kernel of the rows, with a segment for each row."""
    times = np.arange(len(states), dtype=float)
    segments = PiecewiseLinear(times + 1.0, inputs, np.zeros(inputs.shape))
    table = RowRecorder(compiled).evaluate(states, times, segments, 0.0)
    assert np.array_equal(table.inputs, inputs)
    return table.outputs


def one_by_one(compiled, states, inputs):
    """Outputs by the function that integrators and controllers call."""
    result = np.empty((len(states), compiled.sizes.outputs))
    for state, given, row in zip(states.copy(), inputs.copy(), result, strict=True):
        compiled.call("outputs", state, given, compiled.precomputed, row)
    return result


@pytest.mark.parametrize("name", widened(EXAMPLES, BY_DEFAULT.__contains__))
def test_outputs_in_rows_are_those_one_by_one(name):
    compiled = compile_system(EXAMPLES[name])
    states, inputs = points(compiled, 4 * ROWS.lanes + 1)
    expected = one_by_one(compiled, states, inputs)
    size = np.abs(np.where(np.isfinite(expected), expected, 0.0)).max(axis=0)
    assert size.any()
    result = in_rows(compiled, states, inputs)
    assert np.array_equal(np.isfinite(result), np.isfinite(expected))
    with np.errstate(invalid="ignore"):
        assert not (np.abs(result - expected) > TOLERANCE * size).any()


@pytest.mark.parametrize("count", range(1, 2 * ROWS.lanes + 2))
def test_a_row_does_not_depend_on_how_many_there_are(count):
    compiled = compile_system(EXAMPLES["surface"])
    assert compiled.program.outputs_at_rows[1] == ROWS.lanes
    states, inputs = points(compiled, 20)
    everything = in_rows(compiled, states, inputs)
    for first in (0, 3):
        part = slice(first, first + count)
        assert np.array_equal(
            in_rows(compiled, states[part].copy(), inputs[part]), everything[part]
        )


def test_many_outputs_are_computed_one_by_one():
    """Machine code of a large plant's outputs is not generated twice."""
    plant = EXAMPLES["surface"]
    muscles = tuple(dataclasses.replace(plant.muscles[0], name=f"muscle{i}") for i in range(12))
    large = dataclasses.replace(
        plant, muscle=muscles, circuit=plant.circuits * 12, mechanism=HangingMass(60.0)
    )
    compiled = compile_system(large)
    assert compiled.program.outputs_at_rows == (compiled.address["outputs"], 1)
    states, inputs = points(compiled, 7)
    assert np.array_equal(in_rows(compiled, states, inputs), one_by_one(compiled, states, inputs))


@hypothesis.given(
    ends=st.lists(st.integers(1, 40), min_size=1, max_size=20, unique=True),
    times=st.lists(st.integers(0, 45), min_size=1, max_size=40),
    seed=st.integers(0, 99),
)
def test_the_inputs_of_a_row_are_those_of_the_segment_that_holds_or_begins_there(ends, times, seed):
    compiled = compile_system(EXAMPLES["surface"])
    rng = np.random.default_rng(seed)
    sizes = compiled.sizes
    times = np.sort(np.array(times, dtype=float))
    ends = np.sort(np.array(ends, dtype=float))
    values, slopes = rng.uniform(size=(2, len(ends), sizes.inputs))
    states, _ = points(compiled, len(times))
    table = RowRecorder(compiled).evaluate(
        states, times, PiecewiseLinear(ends, values, slopes), 0.0
    )
    held = np.minimum(np.searchsorted(ends, times, side="right"), len(ends) - 1)
    since = times - np.concatenate([[0.0], ends])[held]
    assert table.inputs == pytest.approx(values[held] + slopes[held] * since[:, None], rel=1e-14)
