"""What a zero makes superfluous is skipped, and nothing else changes.

Law: where a gate is zero, whatever is multiplied by it does not matter. So code with branches gives
what the same code gives without: on graphs drawn at random, on plants at shut valves, at and beyond
the ends of a validity range, one by one and in lanes; it computes what it needs, and in lanes no
plant sees its neighbour. Opponent: the instructions in their order.
"""

from __future__ import annotations

import dataclasses
import random
from typing import Any

import numpy as np
import pytest
from filling import hanging

from airmuscle.core import StateVariable, System, model, ops, parameter
from airmuscle.engine import RungeKutta4, Schedule, simulate_batch
from airmuscle.engine.compile import Program, compile_system
from airmuscle.engine.compile.ir import emission
from airmuscle.engine.compile.ir.instructions import Code, Instruction, Operand, Operation
from airmuscle.engine.compile.ir.scheduling import ConditionalBlock
from airmuscle.engine.compile.ir.skipped_blocks import COMMANDED, STEADY, VARYING, skipping
from airmuscle.physics import FillDischarge, Plant, Supply, ThreePositionValve, Valve

BINARY = (
    Operation.ADD,
    Operation.SUBTRACT,
    Operation.MULTIPLY,
    Operation.LESS_EQUAL,
    Operation.LESS,
    Operation.MASK,
    Operation.MAXIMUM,
    Operation.MINIMUM,
)
UNARY = (Operation.NEGATE, Operation.SQUARE, Operation.NOT, Operation.ABS, Operation.SQRT)
MEANING: dict[int, Any] = {
    Operation.ADD: lambda a, b: a + b,
    Operation.SUBTRACT: lambda a, b: a - b,
    Operation.MULTIPLY: lambda a, b: a * b,
    Operation.LESS_EQUAL: lambda a, b: float(a <= b),
    Operation.LESS: lambda a, b: float(a < b),
    Operation.MASK: lambda a, b: b if a else 0.0,
    Operation.MAXIMUM: max,
    Operation.MINIMUM: min,
    Operation.NEGATE: lambda a: -a,
    Operation.SQUARE: lambda a: a * a,
    Operation.NOT: lambda a: float(not a),
    Operation.ABS: abs,
    Operation.SQRT: lambda a: abs(a) ** 0.5,
    Operation.SELECT: lambda a, b, c: b if a else c,
}
"""Every operation on numbers that stay small and finite."""
GRAPHS = 2000
LEAVES: list[Operand] = [
    ("in", 0, 0),
    ("in", 0, 1),
    ("in", 1, 0),
    ("in", 2, 0),
    ("c", 0.0),
    ("c", 1.0),
]


def drawn(rng: random.Random) -> Code:
    """A graph of some dozen instructions, clamps, differences from them and choices among them;
    some of its results.
    """
    known, body = list(LEAVES), list[Instruction]()

    def put(operation: int, *arguments: Operand) -> Operand:
        body.append(Instruction(operation, ("t", len(body)), arguments))
        known.append(body[-1].result)
        return known[-1]

    def pick() -> Operand:
        return known[
            -rng.randint(1, min(8, len(known))) if rng.random() < 0.6 else rng.randrange(len(known))
        ]

    for _ in range(rng.randint(6, 30)):
        kind = rng.randrange(10)
        if kind < 5:
            put(rng.choice(BINARY), pick(), pick())
        elif kind < 6:
            put(rng.choice(UNARY), pick())
        elif kind < 8:
            put(Operation.SELECT, put(Operation.LESS_EQUAL, pick(), pick()), pick(), pick())
        else:
            number = pick()
            ends = [("c", -1.0), ("c", 1.0)]
            low = put(Operation.MAXIMUM, *rng.sample([number, ends[0]], 2))
            clamped = put(Operation.MINIMUM, *rng.sample([low, ends[1]], 2))
            put(Operation.SUBTRACT, *rng.sample([number, clamped], 2))
            put(Operation.LESS_EQUAL, ends[1], low)
            put(Operation.LESS_EQUAL, ends[0], number)
    wanted = rng.sample(known[len(LEAVES) :], rng.randint(1, 4))
    return Code(tuple(body), tuple((0, i, operand) for i, operand in enumerate(wanted)))


def level(operand: Operand) -> int:
    """The first argument varies, the second is commanded, the third steady."""
    return (VARYING, COMMANDED, STEADY)[operand[1]]


class Values(dict[Operand, float]):
    """The values of operands: of results those computed, of constants themselves."""

    def __missing__(self, operand: Operand) -> float:
        if operand[0] != "c":
            raise AssertionError(f"{operand} is used before it is known")
        return float(operand[1])


def computed(items: Any, leaves: dict[Operand, float]) -> tuple[Values, int]:
    """The values of the results, and how many instructions were run."""
    values = Values(leaves)
    count = 0
    for item in items:
        if isinstance(item, ConditionalBlock) and not any(values[gate] for gate in item.gates):
            values.update({result: values[value] for result, value in item.instead})
            continue
        inner = Values(values)
        for line in item.body if isinstance(item, ConditionalBlock) else [item]:
            number = MEANING[line.operation](*(inner[a] for a in line.arguments))
            inner[line.result] = (
                float(np.clip(number, -1e3, 1e3)) if line.operation == Operation.SQUARE else number
            )
            count += 1
        seen = (
            [result for result, _ in item.instead]
            if isinstance(item, ConditionalBlock)
            else [item.result]
        )
        values.update({result: inner[result] for result in seen})
    return values, count


@pytest.mark.parametrize("graphs", [GRAPHS // 20, pytest.param(GRAPHS, marks=pytest.mark.slow)])
def test_random_code_gives_the_same_with_branches(
    monkeypatch: pytest.MonkeyPatch, graphs: int
) -> None:
    """However little a branch saves; with part of the results early, as the rates of a stage are,
    or none.
    """
    monkeypatch.setattr("airmuscle.engine.compile.ir.skipped_blocks.WORTH", 1)
    monkeypatch.setattr("airmuscle.engine.compile.ir.skipped_blocks.WORTH_OF_CHOICES", 1)
    rng = random.Random(1)
    skipped = 0
    for _ in range(graphs):
        code = drawn(rng)
        early = {rng.choice(code.body).result}  # with all that they need
        for line in reversed(code.body):
            if line.result in early:
                early.update(line.arguments)
        for ahead in (frozenset[Operand](), frozenset(early)):
            items = skipping(code, level, ahead)
            pieces = [
                {line.result for line in item.body}
                for item in items
                if isinstance(item, ConditionalBlock)
            ]
            assert all(piece <= ahead or not piece & ahead for piece in pieces)
            for _ in range(3):
                leaves = {leaf: rng.choice([-2.0, -1.0, 0.0, 0.5, 1.0, 3.0]) for leaf in LEAVES[:4]}
                expected, count = computed(code.body, leaves)
                found, fewer = computed(items, leaves)
                skipped += count - fewer
                assert [found[o] for _, _, o in code.outputs] == [
                    expected[o] for _, _, o in code.outputs
                ]
    assert skipped > graphs


def plant(circuit: Any) -> Plant:
    valve = Valve(2.6e-9, 0.433)
    return dataclasses.replace(hanging(), circuit=circuit(Supply(5.5e5), valve, valve))


def test_a_shut_valve_and_a_box_not_left_are_skipped() -> None:
    """Of the rates of a plant, more than a third of all operations; with a valve open, its own come
    back.
    """
    kept: list[Any] = []
    real = emission.skipping
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emission, "skipping", lambda *a: kept.append((a[0], real(*a))) or kept[-1][1])
        Program(plant(FillDischarge))
    code, items = kept[0]
    skipped = [len(item.body) for item in items if isinstance(item, ConditionalBlock)]
    assert len(skipped) >= 3
    assert sum(skipped) > len(code.body) / 3
    assert {len(item.gates) for item in items if isinstance(item, ConditionalBlock)} == {1}


@pytest.mark.parametrize("circuit", [FillDischarge, ThreePositionValve])
def test_plant_has_the_rates_and_slopes_that_it_has_without_branches(circuit: Any) -> None:
    """At shut and open valves, within the validity range of the surface, on its edges and beyond
    them.
    """
    system = plant(circuit)
    new = compile_system(system)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emission, "skipping", lambda code, *rest: list(code.body))
        old = Program(system)
    held = old.precompute(new.parameters)
    sizes = new.sizes
    names = [s.name for s in system.states]
    rng = np.random.default_rng(4)
    for openings in (
        [0.0] * sizes.inputs,
        [1.0] + [0.0] * (sizes.inputs - 1),
        [-0.4] * sizes.inputs,
        [0.3] * sizes.inputs,
    ):
        for contraction in (-0.1, -0.05, 0.0, 0.1, 0.35, 0.5):
            state = system.state_at(pressure=rng.uniform(0, 9e5), position=0.3 * contraction)
            x = np.array([state[name] for name in names])
            u = np.array(openings)
            f = np.empty(sizes.states)
            g = np.empty(sizes.states)
            j = np.empty(sizes.jacobian)
            k = np.empty(sizes.jacobian)
            new.call("jac", x, u, new.precomputed, f, j)
            _call(old, "jac", x, u, held, g, k)
            np.testing.assert_allclose(f, g, rtol=1e-12, atol=1e-15 * np.abs(g).max())
            np.testing.assert_allclose(j, k, rtol=1e-9, atol=1e-13 * np.abs(k).max())


def _call(program: Program, name: str, *arrays: Any) -> None:
    import ctypes

    kinds = [ctypes.c_void_p] * len(arrays)
    ctypes.CFUNCTYPE(None, *kinds)(program.address[name])(*(a.ctypes.data for a in arrays))


@model
class Gated(System):
    """A rate whose flow is NaN unless its input is zero."""

    scale: float = parameter("1", "a", "any factor", default=1.0)

    @property
    def states(self) -> tuple[StateVariable, ...]:
        return (StateVariable("level", "1", 1.0),)

    @property
    def inputs(self) -> tuple[str, ...]:
        return ("opening",)

    def rates(self, state: Any, inputs: Any) -> dict[str, Any]:
        bad = ops.sqrt(-1.0 - state["level"] ** 2) * ops.exp(state["level"])
        return {"level": inputs["opening"] * self.scale * bad - state["level"]}

    def outputs(self, state: Any, inputs: Any) -> dict[str, Any]:
        return {}


def test_what_is_skipped_is_not_computed() -> None:
    ready = compile_system(Gated())
    assert ready.rates([2.0], [0.0]) == pytest.approx([-2.0])
    assert np.isnan(ready.rates([2.0], [0.5])).all()
    assert np.isnan(ready.rates([2.0], [np.nan])).all()


def test_a_lane_that_skips_does_not_see_its_neighbours() -> None:
    """Of sixteen plants in one register row every third opens; the others end where they end
    alone.
    """
    opens = [n % 3 == 0 for n in range(16)]
    commands = [Schedule({"opening": ((0.1, 1.0 if opened else 0.0),)}) for opened in opens]
    batch = simulate_batch(
        Gated(),
        {"scale": np.ones(16)},
        commands,
        duration=0.5,
        initial_states={"level": 1.0},
        integrator=RungeKutta4(1e-2),
    )
    ended = np.asarray(batch.final["level"])
    np.testing.assert_array_equal(np.isfinite(ended), ~np.array(opens))
    np.testing.assert_allclose(ended[~np.array(opens)], np.exp(-0.5), rtol=1e-8)
