"""Polynomials inside a recorded expression, written as sums of monomials."""

import functools
import itertools
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction

from ...core import Node, Operation, nodes, slopes
from .reading import is_constant, power, readable

MAX_TERMS = 150
"""Maximum number of monomials of an expanded polynomial (chosen)."""
MAX_EXPONENT = 20
"""Largest exponent of a power that is expanded (chosen)."""
Monomial = tuple[int, ...]
"""The exponent of each atom."""
Polynomial = dict[Monomial, Node]
"""The coefficient of each monomial. Numbers are fractions, so that their sums are exact."""


def exact(value: float) -> Node:
    """A number whose sums and products with others of this kind are exact."""
    return Node(Operation.CONSTANT, value=Fraction(value))


class Expansion:
    """A recorded expression in which polynomials of atoms are written as sums of monomials.

    atoms       what the monomials are powers of, in the order in which they are written
    known       the polynomials of atoms, parameters and arguments; None of what stays a symbol
    is_written  whether a polynomial is written as a sum of monomials; all others stay as they are
    """

    def __init__(
        self,
        root: Node,
        atoms: Sequence[Node],
        known: Mapping[Node, Polynomial | None],
        is_written: Callable[[Polynomial], bool] = bool,
    ) -> None:
        self._atoms = atoms
        self._known = known
        self._polynomials: dict[Node, Polynomial | None] = dict(known)
        self._is_written = is_written
        self.sums: dict[Node, Polynomial] = {}
        """The sums of monomials in the result, with their polynomials."""
        for node in nodes.in_order([root], set(map(id, known))):
            self._polynomials[node] = self._expanded(node)
        self._written: dict[Node, Node] = {}
        self.value = self._as_written(root)

    def _expanded(self, node: Node) -> Polynomial | None:
        rule = _RULES.get(node.operation)
        arguments = [self._polynomial(argument) for argument in node.arguments]
        inner = [argument for argument in arguments if argument is not None]
        if rule is None or len(inner) < len(arguments):
            return None
        polynomial = rule(*inner)
        return None if polynomial is None or len(polynomial) > MAX_TERMS else polynomial

    def _polynomial(self, node: Node) -> Polynomial | None:
        if is_constant(node):
            return without_atoms(exact(node.value), self._atoms)
        return self._polynomials[node]

    def _as_written(self, node: Node) -> Node:
        if node in self._written:
            return self._written[node]
        terms = self._polynomial(node)
        if terms is not None and self._is_written(terms):
            written = _assembled(terms, self._atoms)
            self.sums[written] = terms
        elif node.arguments and node not in self._known:
            written = readable(node.operation, *map(self._as_written, node.arguments))
        else:
            written = node
        self._written[node] = written
        return written


def without_atoms(coefficient: Node, atoms: Sequence[Node]) -> Polynomial:
    """A number or parameter as a polynomial."""
    return {} if slopes.is_zero(coefficient) else {(0,) * len(atoms): coefficient}


def of_atom(atom: Node, atoms: Sequence[Node], factor: float = 1.0) -> Polynomial:
    """An atom times a number as a polynomial."""
    return {tuple(int(other is atom) for other in atoms): exact(factor)}


def _assembled(polynomial: Polynomial, atoms: Sequence[Node]) -> Node:
    """The sum of monomials by increasing power of the last atom, then of the ones before it.

    Its products are made as they are written, and not looked up: recorded ones have the order of
    the law.
    """
    total = None
    for monomial in sorted(polynomial, key=lambda exponents: exponents[::-1]):
        coefficient = polynomial[monomial]
        is_negative = is_constant(coefficient) and coefficient.value < 0
        if is_constant(coefficient):
            coefficient = nodes.constant(abs(coefficient.value))
        powers = zip(atoms, map(nodes.constant, monomial), strict=True)
        factors = [power(atom, exponent) for atom, exponent in powers if exponent.value]
        if not factors or not is_constant(coefficient) or coefficient.value != 1.0:
            factors.insert(0, coefficient)
        term = functools.reduce(lambda x, y: Node(Operation.MULTIPLY, (x, y)), factors)
        if is_negative:
            term = nodes.negative(term)
        total = term if total is None else Node(Operation.ADD, (total, term))
    return nodes.ZERO if total is None else total


def _sum(a: Polynomial, b: Polynomial) -> Polynomial:
    return _collected(itertools.chain(a.items(), b.items()))


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    return _collected(
        (tuple(map(operator.add, m, n)), nodes.multiply(coefficient, factor))
        for (m, coefficient), (n, factor) in itertools.product(a.items(), b.items())
    )


def _collected(terms: Iterable[tuple[Monomial, Node]]) -> Polynomial:
    """The sum of terms, without monomials that cancel."""
    total: Polynomial = {}
    for monomial, coefficient in terms:
        known = total.get(monomial)
        total[monomial] = coefficient if known is None else nodes.add(known, coefficient)
    return {monomial: c for monomial, c in total.items() if not slopes.is_zero(c)}


def _negative(a: Polynomial) -> Polynomial:
    return {monomial: nodes.negative(c) for monomial, c in a.items()}


def _number_in(a: Polynomial) -> Node | None:
    """The number that a polynomial is; None if it is none, or zero."""
    coefficients = list(a.values())
    is_number = len(a) == 1 and not any(map(any, a)) and is_constant(coefficients[0])
    return coefficients[0] if is_number else None


def _quotient(a: Polynomial, b: Polynomial) -> Polynomial | None:
    number = _number_in(b)
    if number is None:
        return None
    return {monomial: nodes.divide(c, number) for monomial, c in a.items()}


def _power(a: Polynomial, b: Polynomial) -> Polynomial | None:
    number = _number_in(b)
    if number is None or number.value not in range(1, MAX_EXPONENT + 1):
        return None
    result = a
    for _ in range(int(number.value) - 1):
        if len(result) > MAX_TERMS:
            return None
        result = _product(result, a)
    return result


_RULES: dict[Operation, Callable[..., Polynomial | None]] = {
    Operation.ADD: _sum,
    Operation.SUBTRACT: lambda a, b: _sum(a, _negative(b)),
    Operation.NEGATE: _negative,
    Operation.TWICE: lambda a: _sum(a, a),
    Operation.MULTIPLY: _product,
    Operation.DIVIDE: _quotient,
    Operation.INVERSE: lambda a: _quotient(dict.fromkeys(a, exact(1.0)), a),
    Operation.POWER: _power,
}
"""Operations of polynomials that may be polynomials."""
