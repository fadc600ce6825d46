"""Expressions: nodes of a formula, shared where they are equal, with the elementary
simplifications.
"""

import itertools
import math
import operator
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from fractions import Fraction
from typing import Any, TypeVar

Result = TypeVar("Result")

NUMBER = "number"
SYMBOL = "symbol"
ADD = "add"
NEGATIVE = "neg"
PRODUCT = "mul"
QUOTIENT = "div"
POWER = "pow"
MAXIMUM = "max"
MINIMUM = "min"
WHERE = "where"
COMPARISONS = ("lt", "le", "eq", "ne")
FUNCTIONS = (
    "sqrt",
    "exp",
    "log",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "sinh",
    "cosh",
    "tanh",
    "asinh",
    "abs",
)


class Term:
    """An operation, a number (its value) or a symbol (its name). Nodes of one `Expressions` are
    equal if identical.
    """

    __slots__ = ("arguments", "kind", "value")

    def __init__(self, kind: str, arguments: "tuple[Term, ...]", value: Any) -> None:
        self.kind = kind
        self.arguments = arguments
        self.value = value

    @property
    def name(self) -> str:
        """The name of a symbol."""
        return str(self.value)


def is_number(node: Term, value: float | None = None) -> bool:
    """Whether a node is a number, and the given one if a value is given."""
    return node.kind == NUMBER and (value is None or node.value == value)


def in_order(root: Term) -> Iterator[Term]:
    """Each node of an expression once, arguments first."""
    seen: set[Term] = set()
    stack = [(root, False)]
    while stack:
        node, expanded = stack.pop()
        if expanded:
            yield node
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            stack += [
                (argument, False) for argument in reversed(node.arguments) if argument not in seen
            ]


def fold(root: Term, combine: Callable[[Term, list[Result]], Result]) -> Result:
    """The result of an expression: `combine` gives that of each node from those of its arguments,
    and once only.
    """
    results: dict[Term, Result] = {}
    for node in in_order(root):
        results[node] = combine(node, [results[argument] for argument in node.arguments])
    return results[root]


class Expressions:
    """Builder of nodes; equal operations on equal arguments give one node."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[object, ...], Term] = {}
        self._simplified: dict[str, Callable[..., Term]] = {
            "add": self.add,
            "neg": self.negative,
            "mul": self.product,
            "div": self.quotient,
            "pow": self.power,
            "not": self.negation,
            "where": self.where,
            "sq": lambda a: self.product(a, a),
            "sub": lambda a, b: self.add(a, self.negative(b)),
            "twice": lambda a: self.product(self.number(2.0), a),
            "inv": lambda a: self.quotient(self.number(1.0), a),
        }

    def node(self, kind: str, *arguments: Term, value: float | str | None = None) -> Term:
        """An operation as it is; with numbers that are not evaluated, a polynomial is expanded
        exactly.
        """
        key = (kind, value, *arguments)
        return self._nodes.setdefault(key, Term(kind, arguments, value))

    def number(self, value: float) -> Term:
        """A number; minus zero is zero."""
        return self.node(NUMBER, value=float(value) + 0.0)

    def symbol(self, name: str) -> Term:
        """A symbol."""
        return self.node(SYMBOL, value=name)

    def add(self, a: Term, b: Term) -> Term:
        """The sum a + b; the selection of one of two summands is one node."""
        if is_number(a) and is_number(b):
            return self.number(a.value + b.value)
        if is_number(a, 0.0):
            return b
        if is_number(b, 0.0):
            return a
        if self.negative(a) is b:
            return self.number(0.0)
        if a.kind == b.kind == "if":
            condition, when_true = a.arguments
            opposite, when_false = b.arguments
            if opposite is self.negation(condition):
                return self.where(condition, when_true, when_false)
        return self.node(ADD, a, b)

    def negative(self, a: Term) -> Term:
        """The negative -a."""
        if is_number(a):
            return self.number(-a.value)
        return a.arguments[0] if a.kind == NEGATIVE else self.node(NEGATIVE, a)

    def product(self, a: Term, b: Term) -> Term:
        """The product a b; powers of one base are collected, and a sign is moved outside."""
        if is_number(a) and is_number(b):
            return self.number(a.value * b.value)
        for factor, cofactor in ((a, b), (b, a)):
            if is_number(factor, 0.0):
                return factor
            if is_number(factor, 1.0):
                return cofactor
            if factor.kind == NEGATIVE or (is_number(factor) and factor.value < 0):
                return self.negative(self.product(self.negative(factor), cofactor))
        base, m = _as_power(a)
        other_base, n = _as_power(b)
        if base is other_base:
            return self.power(base, self.number(m + n))
        return self.node(PRODUCT, a, b)

    def quotient(self, a: Term, b: Term) -> Term:
        """The quotient a/b."""
        if is_number(a) and is_number(b) and b.value != 0.0:
            return self.number(a.value / b.value)
        if is_number(b, 1.0) or is_number(a, 0.0):
            return a
        if a.kind == NEGATIVE:
            return self.negative(self.quotient(a.arguments[0], b))
        return self.node(QUOTIENT, a, b)

    def power(self, a: Term, exponent: Term) -> Term:
        """The power a^exponent."""
        if is_number(exponent, 0.0):
            return self.number(1.0)
        if is_number(exponent, 1.0):
            return a
        if (
            is_number(a)
            and is_number(exponent)
            and (a.value > 0 or exponent.value == int(exponent.value) > 0)
        ):
            return self.number(a.value**exponent.value)
        return self.node(POWER, a, exponent)

    def negation(self, condition: Term) -> Term:
        """The logical negation of a condition."""
        if is_number(condition):
            return self.number(float(condition.value == 0.0))
        return condition.arguments[0] if condition.kind == "not" else self.node("not", condition)

    def where(self, condition: Term, a: Term, b: Term) -> Term:
        """a where the condition holds, else b; a maximum, minimum or absolute value if it is
        one.
        """
        if a is b:
            return a
        if is_number(condition):
            return a if condition.value != 0.0 else b
        if condition.kind == "not":
            return self.where(condition.arguments[0], b, a)
        if condition.kind in ("lt", "le"):
            low, high = condition.arguments
            if (low, high) == (b, a):
                return self.node(MAXIMUM, a, b)
            if (low, high) == (a, b):
                return self.node(MINIMUM, a, b)
            if is_number(low, 0.0) and high is a and b is self.negative(a):
                return self.node("abs", a)
        return self.node(WHERE, condition, a, b)

    def apply(self, kind: str, *arguments: Term) -> Term:
        """Any operation by its kind, simplified."""
        if kind in self._simplified:
            return self._simplified[kind](*arguments)
        if kind == "if" and is_number(arguments[0]):
            return arguments[1] if arguments[0].value != 0.0 else self.number(0.0)
        if kind in COMPARISONS and all(map(is_number, arguments)):
            compare = getattr(operator, kind)
            values = [argument.value for argument in arguments]
            return self.number(float(compare(*values)))
        return self.node(kind, *arguments)


def _as_power(node: Term) -> tuple[Term, float]:
    if (
        node.kind == POWER
        and is_number(node.arguments[1])
        and math.isfinite(node.arguments[1].value)
    ):
        return node.arguments[0], node.arguments[1].value
    return node, 1.0


MAX_TERMS = 150
MIN_TERMS = 4
"""Maximum number of monomials of an expanded polynomial, minimum one with its coefficients as
symbols (chosen).
"""
MAX_EXPONENT = 20
"""Largest exponent of a power that is expanded (chosen)."""
Monomial = tuple[tuple[Term, int], ...]
Polynomial = dict[Monomial, Fraction]


def expand(root: Term, atoms: Collection[Term]) -> Polynomial | None:
    """An expression as a polynomial in these atoms with exact coefficients; None if it is none, or
    is too long.
    """

    def expanded(node: Term, inner: list[Polynomial | None]) -> Polynomial | None:
        if node in atoms:
            return {((node, 1),): Fraction(1)}
        if is_number(node):
            return {(): Fraction(node.value)} if node.value else {}
        if (
            node.kind not in (ADD, NEGATIVE, PRODUCT, QUOTIENT, POWER)
            or inner[0] is None
            or inner[-1] is None
        ):
            return None
        combined = _combined(node.kind, inner[0], inner[-1])
        return combined if combined is None or len(combined) <= MAX_TERMS else None

    return fold(root, expanded)


def _combined(kind: str, first: Polynomial, last: Polynomial) -> Polynomial | None:
    """The result of an operation without monomials that cancel; None if it is no polynomial, or is
    too long.
    """
    if kind == ADD:
        return _sum(first, last)
    if kind == NEGATIVE:
        return {monomial: -c for monomial, c in first.items()}
    if kind == PRODUCT:
        return _product(first, last)
    number = last[()] if set(last) == {()} else None
    if number is None:
        return None
    if kind == QUOTIENT:
        return {monomial: c / number for monomial, c in first.items()}
    return _power(first, number)


def _sum(first: Polynomial, last: Polynomial) -> Polynomial:
    total = dict(first)
    for monomial, coefficient in last.items():
        total[monomial] = total.get(monomial, Fraction(0)) + coefficient
    return _without_zeros(total)


def _product(first: Polynomial, last: Polynomial) -> Polynomial:
    total: defaultdict[Monomial, Fraction] = defaultdict(Fraction)
    pairs = itertools.product(first.items(), last.items())
    for (monomial, coefficient), (cofactor, factor) in pairs:
        powers = Counter(dict(monomial))
        powers += Counter(dict(cofactor))
        in_one_order = sorted(powers.items(), key=_place_in_monomial)
        total[tuple(in_one_order)] += coefficient * factor
    return _without_zeros(total)


def _without_zeros(polynomial: Polynomial) -> Polynomial:
    return {monomial: c for monomial, c in polynomial.items() if c}


def _place_in_monomial(power: tuple[Term, int]) -> tuple[str, int]:
    """By name; parts, which have none, in any order that is the same in all monomials."""
    atom, _ = power
    return str(atom.value or ""), id(atom)


def _power(base: Polynomial, exponent: Fraction) -> Polynomial | None:
    if exponent.denominator != 1 or not 0 < exponent <= MAX_EXPONENT:
        return None
    result: Polynomial = {(): Fraction(1)}
    for _ in range(int(exponent)):
        if len(result) > MAX_TERMS:
            return None
        result = _product(result, base)
    return result


def coefficients_by_monomial(
    polynomial: Polynomial, parameters: Collection[Term]
) -> dict[Monomial, Term] | None:
    """The one parameter before each monomial in the other atoms; None unless there is exactly one,
    with factor 1.
    """
    result: dict[Monomial, Term] = {}
    for monomial, factor in polynomial.items():
        coefficients = [(node, power) for node, power in monomial if node in parameters]
        rest = tuple((node, power) for node, power in monomial if node not in parameters)
        if factor != 1 or len(coefficients) != 1 or coefficients[0][1] != 1 or rest in result:
            return None
        result[rest] = coefficients[0][0]
    if len(set(result.values())) < len(result) or len(result) < MIN_TERMS:
        return None
    return result


def assemble(terms: Mapping[Monomial, Term], atoms: list[Term], new: Expressions) -> Term:
    """The sum of coefficients times monomials, by increasing power of the last atom, then of the
    ones before it.
    """
    order = sorted(terms, key=lambda m: tuple(dict(m).get(atom, 0) for atom in reversed(atoms)))
    total = new.number(0.0)
    for monomial in order:
        term = terms[monomial]
        for node, power in sorted(monomial, key=lambda item: atoms.index(item[0])):
            factor = new.power(node, new.number(power))
            term = factor if is_number(term, 1.0) else new.product(term, factor)
        total = new.add(total, term)
    return total


def summands(node: Term) -> list[Term]:
    """The terms of a sum, in their order; any other node is one term."""
    terms: list[Term] = []
    while node.kind == ADD:
        node, last = node.arguments
        terms.append(last)
    return [node, *reversed(terms)]


def depends_on(root: Term, symbols: Collection[Term]) -> list[Term]:
    """The given symbols that occur in an expression, in their order."""
    present = set(in_order(root))
    return [symbol for symbol in symbols if symbol in present]
