"""Equation of a law: its traced expression in named symbols, with shared parts defined once."""

import dataclasses
import itertools
import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from ...core import Leaf, ShortRepr, leaves
from . import expression
from .expression import Expressions, Term, assemble, depends_on, expand, fold, in_order, summands
from .intervals import Bounds, traced_expression, within

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
BAR = 1e5
"""Pressure unit of the physical form [Pa]."""

_INDEX = re.compile(r"\[\d+\]$")
_POLYNOMIAL_KINDS = (
    expression.ADD,
    expression.NEGATIVE,
    expression.PRODUCT,
    expression.QUOTIENT,
)


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
_PART_NAMES = {("p",): "qhn", ("eps",): "xyz", ("F",): "ywv", (): "cgsm"}
"""Symbols of shared parts by the arguments that they depend on: the first that no parameter has."""
_MIXED_PART_NAMES = "zwv"
_SUM_NAMES = "uvs"
"""Symbols of other shared parts, and of long sums."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class LawEquation(ShortRepr):
    """A law as an equation within a validity range; symbols stand under their names in the
    expressions.
    """

    title: str
    result: Symbol
    arguments: tuple[Symbol, ...]
    parameters: tuple[Symbol, ...]
    """With their values, in the order of their first occurrence in the law."""
    value: Term
    part_nodes: Mapping[Term, str]
    """Names of the parts that occur repeatedly, each defined by the ones before it."""

    @property
    def parts(self) -> tuple[tuple[Symbol, Term], ...]:
        """The symbols of the parts with their definitions."""
        return tuple((Symbol(name, "", ""), node) for node, name in self.part_nodes.items())


@dataclasses.dataclass(frozen=True, eq=False)
class _Traced:
    """A law within a validity range: its arguments, its parameters with their leaves, and the
    expression.
    """

    new: Expressions
    arguments: tuple[Term, ...]
    parameters: Mapping[Term, Leaf]
    value: Term


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
    traced = _trace(law, quantity, arguments, ranges)
    if traced is None:
        return ()
    names = [ARGUMENTS[name] for name in arguments]
    value, coefficients = _with_monomials(traced)
    if _operations(value) > MAX_OPERATIONS:
        return ()
    labels = _labels(traced, coefficients)
    if len(depends_on(value, list(labels))) > MAX_PARAMETERS:
        return ()
    scaled = _named(value, traced, labels, ARGUMENTS[quantity], names)
    physical = (
        _physical(traced, ARGUMENTS[quantity], names) if coefficients and scaled.parts else None
    )
    return (scaled,) if physical is None else (scaled, physical)


def _trace(
    law: Any, quantity: str, arguments: Sequence[str], ranges: Mapping[str, Bounds]
) -> _Traced | None:
    new = Expressions()
    points = tuple(new.symbol(ARGUMENTS[name].name) for name in arguments)
    parameters: dict[Term, Leaf] = {}
    bounds: dict[Term, Bounds] = {}
    for leaf in leaves(law):
        symbol = new.symbol(f"parameter {leaf.path}")
        number = float(leaf.value)
        parameters[symbol] = leaf
        bounds[symbol] = (number, number)
    value = traced_expression(law, quantity, new, points, list(parameters))
    if value is None:
        return None
    for point, name in zip(points, arguments, strict=True):
        bounds[point] = ranges[name]

    def complete(old: Term, arguments: list[Term]) -> Term:
        if old.kind == "if":  # a branch that has one side only is a choice between it and zero
            return new.apply(expression.WHERE, *arguments, new.number(0.0))
        return new.apply(old.kind, *arguments) if arguments else old

    reached = within(value, new, bounds)
    return _Traced(new, points, parameters, fold(reached, complete))


def _with_monomials(traced: _Traced) -> tuple[Term, dict[Term, tuple[int, ...]]]:
    """The expression with every polynomial written as a sum of monomials, and the powers by
    coefficient.
    """
    powers: dict[Term, tuple[int, ...]] = {}
    atoms = _atoms(traced)

    def coefficients(node: Term) -> dict[expression.Monomial, Term] | None:
        if node.kind not in _POLYNOMIAL_KINDS:
            return None
        polynomial = expand(node, {*atoms, *traced.parameters})
        if polynomial is None:
            return None
        return expression.coefficients_by_monomial(polynomial, traced.parameters)

    def rewritten(node: Term) -> Term:
        if node in atoms or not node.arguments:
            return node
        terms = coefficients(node)
        if terms is None:
            arguments = [rewritten(argument) for argument in node.arguments]
            return traced.new.apply(node.kind, *arguments)
        used = [atom for atom in atoms if any(atom in dict(monomial) for monomial in terms)]
        for monomial, coefficient in terms.items():
            power_of = dict(monomial)
            powers[coefficient] = tuple(power_of.get(atom, 0) for atom in used)
        return assemble(terms, used, traced.new)

    if _operations(traced.value) > MAX_OPERATIONS:
        return traced.value, powers
    return rewritten(traced.value), powers


def _atoms(traced: _Traced) -> list[Term]:
    """What the monomials are powers of: the shared parts of one argument, then the arguments."""
    shared = _shared(traced.value)
    place_of_argument: dict[Term, int] = {}
    for node in in_order(traced.value):
        of = depends_on(node, traced.arguments) if node in shared else ()
        if len(of) == 1:
            place_of_argument[node] = traced.arguments.index(of[0])
    parts = sorted(place_of_argument, key=lambda part: place_of_argument[part], reverse=True)
    return [*parts, *reversed(traced.arguments)]


def _operations(root: Term) -> int:
    return sum(1 for node in in_order(root) if node.arguments)


def _shared(root: Term) -> set[Term]:
    """The parts of an expression that occur repeatedly and are not short."""
    nodes = list(in_order(root))
    uses = Counter(argument for node in nodes for argument in node.arguments)
    shared: set[Term] = set()
    cost: dict[Term, int] = {}
    for node in nodes:
        is_operation = bool(node.arguments) and node.kind != expression.NEGATIVE
        repeated = set(node.arguments) - shared
        cost[node] = is_operation + sum(cost[argument] for argument in repeated)
        if uses[node] < 2 or node.kind in expression.COMPARISONS:
            continue
        enough = MIN_SHARED_OPERATIONS if uses[node] == 2 else MIN_SHARED_OPERATIONS - 1
        if cost[node] >= enough:
            shared.add(node)
    return shared


def _long_sums(root: Term) -> set[Term]:
    """The sums inside an expression that have too many terms to stand inside a function or
    product.
    """
    inner = (
        part for node in in_order(root) for part in node.arguments[node.kind == expression.ADD :]
    )
    return {
        part
        for part in inner
        if part.kind == expression.ADD and len(summands(part)) > MAX_INNER_TERMS
    }


def _labels(traced: _Traced, powers: Mapping[Term, tuple[int, ...]]) -> dict[Term, str]:
    """A name for each parameter: its symbol with the powers or the number of a coefficient, unique
    in the law.
    """
    lists: dict[str, list[Term]] = {}
    for node, leaf in traced.parameters.items():
        path_of_list = _INDEX.sub("", leaf.path)
        lists.setdefault(path_of_list, []).append(node)
    names: dict[Term, str] = {}
    for nodes in lists.values():
        leaf = traced.parameters[nodes[0]]
        base = _as_identifier(leaf.declared.symbol).strip("_") or "c"
        if _INDEX.search(leaf.path):
            base = re.sub(r"_(ij|i|j|k)$", "", base)
            for node, index in zip(nodes, _indices(nodes, powers), strict=True):
                names[node] = f"{base}_{index}"
        else:
            names[nodes[0]] = base
    counts = Counter(names.values())
    taken = {symbol.name for symbol in ARGUMENTS.values()}
    taken.add(PRESSURE_IN_BAR.name)
    for node, leaf in traced.parameters.items():
        name = names[node]
        if counts[name] > 1 or name in taken:
            path_of_owner, _, _ = _INDEX.sub("", leaf.path).rpartition(".")
            owner = _as_identifier(path_of_owner) or "law"
            names[node] = f"{name}_{owner}"
    return names


def _as_identifier(text: str) -> str:
    return re.sub(r"\W+", "_", text)


def _indices(coefficients: Sequence[Term], powers: Mapping[Term, tuple[int, ...]]) -> list[str]:
    """The powers of the monomial of each coefficient; its number where these are not unique."""
    indices = []
    for coefficient in coefficients:
        digits = map(str, powers.get(coefficient, ()))
        indices.append("".join(digits))
    if "" in indices or len(set(indices)) < len(indices):
        return [str(number) for number in range(len(coefficients))]
    return indices


def _named(
    value: Term,
    traced: _Traced,
    labels: Mapping[Term, str],
    result: Symbol,
    arguments: Sequence[Symbol],
) -> LawEquation:
    """The equation with its parameters and shared parts under their names."""
    new = traced.new

    def renamed(node: Term, inner: list[Term]) -> Term:
        if inner:
            return new.apply(node.kind, *inner)
        return new.symbol(labels[node]) if node in labels else node

    root = fold(value, renamed)
    shared = _shared(root) | _long_sums(root)
    present = set(in_order(root))
    parameters = tuple(
        Symbol(labels[node], leaf.declared.unit, leaf.declared.meaning, float(leaf.value))
        for node, leaf in sorted(
            traced.parameters.items(), key=lambda item: not item[1].declared.fitted
        )
        if new.symbol(labels[node]) in present
    )
    names = _part_names(
        [n for n in in_order(root) if n in shared], traced.arguments, {p.name for p in parameters}
    )
    return LawEquation(
        "Parameters as symbols, SI units", result, tuple(arguments), parameters, root, names
    )


def _part_names(
    parts: Sequence[Term], arguments: Sequence[Term], taken: Collection[str]
) -> dict[Term, str]:
    names: dict[Term, str] = {}
    used = {name.partition("_")[0] for name in taken}
    for node in parts:
        names_of_arguments = tuple(symbol.name for symbol in depends_on(node, arguments))
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


def _physical(traced: _Traced, result: Symbol, arguments: Sequence[Symbol]) -> LawEquation | None:
    """The polynomials with numbers, in the physical arguments, pressures in bar; None if there is
    none.
    """
    new = traced.new
    bar = new.symbol(PRESSURE_IN_BAR.name)

    def in_numbers(node: Term, inner: list[Term]) -> Term:
        if node in traced.parameters:
            return new.number(float(traced.parameters[node].value))
        if node in traced.arguments and node.name == ARGUMENTS["pressure"].name:
            return new.product(new.number(BAR), bar)
        # products and quotients of numbers are not evaluated
        return new.node(node.kind, *inner) if inner else node

    points = [bar if node.name == "p" else node for node in reversed(traced.arguments)]
    count = 0

    def rewritten(node: Term) -> Term:
        nonlocal count
        if not node.arguments:
            return node
        polynomial = expand(node, points)
        if polynomial is None:
            return new.apply(node.kind, *map(rewritten, node.arguments))
        count += 1
        terms = {monomial: new.number(float(c)) for monomial, c in polynomial.items()}
        return assemble(terms, points, new)

    value = rewritten(fold(traced.value, in_numbers))
    if not count:
        return None
    symbols = tuple(
        PRESSURE_IN_BAR if argument.unit == "Pa" else argument for argument in arguments
    )
    names = _part_names([n for n in in_order(value) if n in _long_sums(value)], points, ())
    return LawEquation(
        "Physical form: numbers, with the pressure in bar", result, symbols, (), value, names
    )
