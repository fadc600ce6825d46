"""Equation of a law: its recorded expression in named symbols, with shared parts defined once."""

import dataclasses
import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ...core import CONDITIONS, Leaf, Node, Operation, ShortRepr, autodiff, leaves, nodes
from .polynomials import Expansion, Polynomial, exact, of_atom, without_atoms
from .reading import Bounds, within

MAX_OPERATIONS = 600
MAX_PARAMETERS = 120
"""Maximum number of operations and of parameters of an equation that is shown (chosen)."""
MIN_SHARED_OPERATIONS = 3
"""Minimum operations of a part that occurs twice and gets its own symbol; one less if it occurs
more often (chosen).
"""
MAX_INNER_TERMS = 6
"""Maximum number of terms of a sum inside a function or product; a longer one gets a symbol of its
own (chosen).
"""
MIN_TERMS = 4
"""Minimum number of monomials of a sum with the coefficients as symbols (chosen)."""
BAR = 1e5
"""Pressure unit of the physical form [Pa]."""
LENGTH_SYMBOL = "L_0"
"""The declared symbol of the resting length, which the physical form keeps where it can."""

_INDEX = re.compile(r"\[\d+\]$")


@dataclasses.dataclass(frozen=True)
class Symbol:
    """A symbol of an equation; the value [SI] is NaN for an argument, for the result and for a
    shared part.
    """

    name: str
    unit: str
    meaning: str
    value: float = math.nan


ARGUMENTS = {
    "pressure": Symbol("p", "Pa", "gauge pressure"),
    "contraction": Symbol("eps", "1", "contraction"),
    "force": Symbol("F", "N", "force"),
}
"""Arguments and results of laws."""
PRESSURE_IN_BAR = Symbol("P", "bar", "gauge pressure")
_PART_NAMES = {("p",): "qhn", ("P",): "qhn", ("eps",): "xyz", ("F",): "ywv", (): "cgsm"}
"""Symbols of shared parts by the arguments that they depend on: the first that no parameter has."""
_MIXED_PART_NAMES = "zwv"
_SUM_NAMES = "uvs"
"""Symbols of other shared parts, and of long sums."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LawEquation(ShortRepr):
    """A law as an equation within a validity range."""

    title: str
    result: Symbol
    arguments: tuple[Symbol, ...]
    parameters: tuple[Symbol, ...]
    """With their values, in the order of their first occurrence in the law."""
    value: Node
    names: Mapping[Node, str]
    """Names of the arguments, of the parameters, and of the parts that occur repeatedly, each
    defined by the ones before it."""

    @property
    def parts(self) -> tuple[tuple[Symbol, Node], ...]:
        """The symbols of the parts with their definitions."""
        names = self.names.items()
        return tuple((Symbol(name, "", ""), node) for node, name in names if node.arguments)


@dataclasses.dataclass(frozen=True, eq=False)
class _Recorded:
    """A law within a validity range: its arguments, its parameters with their leaves, and the
    expression.
    """

    arguments: dict[Node, Symbol]
    parameters: Mapping[Node, Leaf]
    result: Symbol
    value: Node


def law_equation(
    law: Any, quantity: str, arguments: Sequence[str], ranges: Mapping[str, Bounds]
) -> tuple[LawEquation, ...]:
    """The equations of a law for one quantity in terms of two others, for arguments within their
    ranges [SI].

    The first has the parameters as symbols. If the law is a polynomial of scaled arguments, the
    second is the same polynomial in the physical quantities, the pressure in bar. No equation if
    the law has no closed form, or one of more than `MAX_OPERATIONS` operations. Limits and
    extrapolations beyond the ranges are left out.
    """
    recorded = _record(law, quantity, arguments, ranges)
    if recorded is None or _operations(recorded.value) > MAX_OPERATIONS:
        return ()
    value, powers = _with_monomials(recorded)
    if _operations(value) > MAX_OPERATIONS:
        return ()
    labels = _labels(recorded, powers)
    if sum(nodes.occurring([value], list(labels))) > MAX_PARAMETERS:
        return ()
    title = "Parameters as symbols, SI units"
    scaled = _named(recorded, title, value, recorded.arguments, labels)
    return (scaled, _physical_form(recorded, labels)) if powers and scaled.parts else (scaled,)


def _record(
    law: Any, quantity: str, arguments: Sequence[str], ranges: Mapping[str, Bounds]
) -> _Recorded | None:
    """The recorded law; None if it cannot be recorded, or contains what no notation has."""
    if not law.traceable:
        return None
    model, symbols = autodiff.symbolic(law)
    points = [nodes.symbol(ARGUMENTS[name].name) for name in arguments]
    value = nodes.as_node(getattr(model, quantity)(*points))
    autodiff.check_finite([value], f"{type(law).__name__}.{quantity}")
    parameters = dict(zip(symbols, leaves(law), strict=True))
    bounds: dict[Node, Bounds] = {}
    for symbol, leaf in parameters.items():
        number = float(leaf.value)
        bounds[symbol] = (number, number)
    named: dict[Node, Symbol] = {}
    for point, name in zip(points, arguments, strict=True):
        bounds[point] = ranges[name]
        named[point] = ARGUMENTS[name]
    reached = within(value, bounds)
    if reached is None:
        return None
    return _Recorded(named, parameters, ARGUMENTS[quantity], reached)


def _with_monomials(recorded: _Recorded) -> tuple[Node, dict[Node, tuple[int, ...]]]:
    """The expression with the polynomials whose coefficients are parameters as sums of monomials,
    and the powers by parameter.
    """

    def is_written(polynomial: Polynomial) -> bool:
        coefficients = set(polynomial.values())
        are_parameters = coefficients <= recorded.parameters.keys()
        return are_parameters and len(coefficients) == len(polynomial) >= MIN_TERMS

    atoms = _atoms(recorded)
    known = {node: without_atoms(node, atoms) for node in recorded.parameters}
    known |= {node: of_atom(node, atoms) for node in atoms}
    expansion = Expansion(recorded.value, atoms, known, is_written)
    powers: dict[Node, tuple[int, ...]] = {}
    for polynomial in expansion.sums.values():
        used = list(map(any, zip(*polynomial, strict=True)))
        for monomial, coefficient in polynomial.items():
            powers[coefficient] = tuple(itertools.compress(monomial, used))
    return expansion.value, powers


def _atoms(recorded: _Recorded) -> list[Node]:
    """What the monomials are powers of: the shared parts of one argument, then the arguments."""
    arguments = list(recorded.arguments)
    shared = _shared(recorded.value)
    place_of_argument: dict[Node, int] = {}
    for node in nodes.in_order([recorded.value]):
        occurring = nodes.occurring([node], arguments) if node in shared else []
        if sum(occurring) == 1:
            place_of_argument[node] = occurring.index(True)
    parts = sorted(place_of_argument, key=lambda part: place_of_argument[part], reverse=True)
    return [*parts, *reversed(arguments)]


def _operations(root: Node) -> int:
    return sum(1 for node in nodes.in_order([root]) if node.arguments)


def summands(node: Node) -> list[Node]:
    """The terms of a sum, in their order; any other node is one term."""
    terms: list[Node] = []
    while node.operation in (Operation.ADD, Operation.SUBTRACT):
        is_sum = node.operation == Operation.ADD
        node, last = node.arguments
        terms.append(last if is_sum else nodes.negative(last))
    return [node, *reversed(terms)]


def _shared(root: Node) -> set[Node]:
    """The parts of an expression that occur repeatedly and are not short."""
    ordered = nodes.in_order([root])
    uses = Counter(argument for node in ordered for argument in node.arguments)
    shared: set[Node] = set()
    cost: dict[Node, int] = {}
    for node in ordered:
        is_operation = bool(node.arguments) and node.operation != Operation.NEGATE
        repeated = set(node.arguments) - shared
        cost[node] = is_operation + sum(cost.get(argument, 0) for argument in repeated)
        if uses[node] < 2 or node.operation in CONDITIONS:
            continue
        enough = MIN_SHARED_OPERATIONS if uses[node] == 2 else MIN_SHARED_OPERATIONS - 1
        if cost[node] >= enough:
            shared.add(node)
    return shared


def _long_sums(root: Node) -> set[Node]:
    """The sums inside an expression that have too many terms to stand inside a function or
    product.
    """
    sums = (Operation.ADD, Operation.SUBTRACT)
    inner = (
        part for node in nodes.in_order([root]) for part in node.arguments[node.operation in sums :]
    )
    return {
        part for part in inner if part.operation in sums and len(summands(part)) > MAX_INNER_TERMS
    }


def _labels(recorded: _Recorded, powers: Mapping[Node, tuple[int, ...]]) -> dict[Node, str]:
    """A name for each parameter: its symbol with the powers or the number of a coefficient, unique
    in the law.
    """
    lists: dict[str, list[Node]] = {}
    for node, leaf in recorded.parameters.items():
        path_of_list = _INDEX.sub("", leaf.path)
        lists.setdefault(path_of_list, []).append(node)
    names: dict[Node, str] = {}
    for coefficients in lists.values():
        leaf = recorded.parameters[coefficients[0]]
        base = _as_identifier(leaf.declared.symbol).strip("_") or "c"
        if _INDEX.search(leaf.path):
            base = re.sub(r"_(ij|i|j|k)$", "", base)
            for node, index in zip(coefficients, _indices(coefficients, powers), strict=True):
                names[node] = f"{base}_{index}"
        else:
            names[coefficients[0]] = base
    counts = Counter(names.values())
    taken = {symbol.name for symbol in ARGUMENTS.values()}
    taken.add(PRESSURE_IN_BAR.name)
    for node, leaf in recorded.parameters.items():
        name = names[node]
        if counts[name] > 1 or name in taken:
            path_of_owner, _, _ = _INDEX.sub("", leaf.path).rpartition(".")
            owner = _as_identifier(path_of_owner) or "law"
            names[node] = f"{name}_{owner}"
    return names


def _as_identifier(text: str) -> str:
    return re.sub(r"\W+", "_", text)


def _indices(coefficients: Sequence[Node], powers: Mapping[Node, tuple[int, ...]]) -> list[str]:
    """The powers of the monomial of each coefficient; its number where these are not unique."""
    indices = []
    for coefficient in coefficients:
        digits = map(str, powers.get(coefficient, ()))
        indices.append("".join(digits))
    if "" in indices or len(set(indices)) < len(indices):
        return [str(number) for number in range(len(coefficients))]
    return indices


def _named(
    recorded: _Recorded,
    title: str,
    value: Node,
    arguments: dict[Node, Symbol],
    labels: Mapping[Node, str],
) -> LawEquation:
    """The equation with its arguments, parameters, repeated parts and long sums under their
    names."""
    ordered = nodes.in_order([value])
    parts = _shared(value) | _long_sums(value)
    parameters = {
        node: Symbol(labels[node], leaf.declared.unit, leaf.declared.meaning, float(leaf.value))
        for node, leaf in sorted(
            recorded.parameters.items(), key=lambda item: not item[1].declared.fitted
        )
        if node in set(ordered)
    }
    names = {node: symbol.name for node, symbol in (arguments | parameters).items()}
    names |= _part_names(
        [node for node in ordered if node in parts],
        arguments,
        {symbol.name for symbol in parameters.values()},
    )
    symbols = tuple(arguments.values())
    return LawEquation(title, recorded.result, symbols, tuple(parameters.values()), value, names)


def _part_names(
    parts: Sequence[Node], arguments: Mapping[Node, Symbol], taken: Collection[str]
) -> dict[Node, str]:
    names: dict[Node, str] = {}
    used = {name.partition("_")[0] for name in taken}
    symbols = list(arguments.values())
    for node in parts:
        occurring = nodes.occurring([node], list(arguments))
        names_of_arguments = tuple(symbol.name for symbol in itertools.compress(symbols, occurring))
        letters = (
            _SUM_NAMES
            if len(summands(node)) > MAX_INNER_TERMS
            else _PART_NAMES.get(names_of_arguments, _MIXED_PART_NAMES)
        )
        base = next((letter for letter in letters if letter not in used), letters[0])
        tried = itertools.chain([base], (f"{base}_{number}" for number in itertools.count(2)))
        names[node] = next(
            name for name in tried if name not in taken and name not in names.values()
        )
    return names


def _physical_form(recorded: _Recorded, labels: Mapping[Node, str]) -> LawEquation:
    """The polynomials with numbers, in the physical arguments, pressures in bar.

    The resting length stays a symbol where it is apart from the arguments, as in a factor of a
    polynomial: the equation then holds for any length.
    """
    bar = nodes.symbol(PRESSURE_IN_BAR.name)
    arguments = {
        bar if symbol.unit == "Pa" else node: PRESSURE_IN_BAR if symbol.unit == "Pa" else symbol
        for node, symbol in recorded.arguments.items()
    }
    atoms = list(arguments)[::-1]
    scaled: dict[Node, Polynomial | None] = {
        node: of_atom(bar, atoms, BAR) if symbol.unit == "Pa" else of_atom(node, atoms)
        for node, symbol in recorded.arguments.items()
    }
    numbers: dict[Node, Polynomial | None] = {
        node: without_atoms(exact(float(leaf.value)), atoms)
        for node, leaf in recorded.parameters.items()
    }
    lengths: dict[Node, Polynomial | None] = {
        node: None
        for node, leaf in recorded.parameters.items()
        if leaf.declared.symbol == LENGTH_SYMBOL
    }
    for known in (numbers | lengths, numbers):
        expansion = Expansion(recorded.value, atoms, scaled | known)
        long = {id(node) for node, terms in expansion.sums.items() if len(terms) >= MIN_TERMS}
        if not any(node in arguments for node in nodes.in_order([expansion.value], long)):
            break
    title = "Physical form: numbers, with the pressure in bar"
    return _named(recorded, title, expansion.value, arguments, labels)
