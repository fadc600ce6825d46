"""Polynomials inside an expression, expanded into monomials."""

from collections import Counter
from collections.abc import Collection, Mapping
from fractions import Fraction

from .expression import ADD, Expressions, Node, in_order, is_number

MAX_TERMS = 150
"""Maximum number of monomials of a polynomial that is expanded (chosen)."""
MIN_TERMS = 4
"""Minimum number of monomials of a polynomial that is expanded with its coefficients as symbols (chosen)."""
Monomial = tuple[tuple[Node, int], ...]
Polynomial = dict[Monomial, Fraction]


def expand(root: Node, atoms: Collection[Node]) -> Polynomial | None:
    """An expression as a polynomial in these atoms with exact coefficients; None if it is none, or is too long."""
    expanded: dict[Node, Polynomial | None] = {}
    for node in in_order(root):
        expanded[node] = _expand_one(node, atoms, expanded)
    return expanded[root]


def _expand_one(node: Node, atoms: Collection[Node], expanded: Mapping[Node, Polynomial | None]) -> Polynomial | None:
    if node in atoms:
        return {((node, 1),): Fraction(1)}
    if is_number(node):
        return {(): Fraction(node.number)} if node.number else {}
    if node.kind not in ("add", "neg", "mul", "div", "pow"):
        return None
    first, last = expanded[node.arguments[0]], expanded[node.arguments[-1]]
    if first is None or last is None:
        return None
    if node.kind == "add":
        return _sum(first, last)
    if node.kind == "neg":
        return {monomial: -c for monomial, c in first.items()}
    if node.kind == "mul":
        return _product(first, last)
    if set(last) != {()}:
        return None
    divisor = last[()]
    if node.kind == "div":
        return {monomial: c / divisor for monomial, c in first.items()}
    return _power(first, divisor)


def _power(base: Polynomial, exponent: Fraction) -> Polynomial | None:
    if exponent.denominator != 1 or not 0 < exponent <= 20:
        return None
    result: Polynomial | None = {(): Fraction(1)}
    for _ in range(int(exponent)):
        result = None if result is None else _product(result, base)
    return result


def _sum(a: Polynomial, b: Polynomial) -> Polynomial | None:
    total = dict(a)
    for monomial, c in b.items():
        total[monomial] = total.get(monomial, Fraction(0)) + c
    return _checked({monomial: c for monomial, c in total.items() if c})


def _product(a: Polynomial, b: Polynomial) -> Polynomial | None:
    total: Polynomial = {}
    for m, c in a.items():
        for n, d in b.items():
            powers = Counter(dict(m))
            powers.update(dict(n))
            key = tuple(sorted(powers.items(), key=lambda item: _order(item[0])))
            total[key] = total.get(key, Fraction(0)) + c * d
    return _checked({monomial: c for monomial, c in total.items() if c})


def _checked(polynomial: Polynomial) -> Polynomial | None:
    return polynomial if len(polynomial) <= MAX_TERMS else None


def _order(node: Node) -> tuple[str, int]:
    return (str(node.value or ""), id(node))


def coefficients_by_monomial(polynomial: Polynomial, parameters: Collection[Node]) -> dict[Monomial, Node] | None:
    """The one parameter before each monomial in the other atoms; None unless there is exactly one, with factor 1."""
    result: dict[Monomial, Node] = {}
    for monomial, factor in polynomial.items():
        own = [(node, power) for node, power in monomial if node in parameters]
        rest = tuple((node, power) for node, power in monomial if node not in parameters)
        if factor != 1 or len(own) != 1 or own[0][1] != 1 or rest in result:
            return None
        result[rest] = own[0][0]
    if len(set(result.values())) < len(result) or len(result) < MIN_TERMS:
        return None
    return result


def assemble(terms: Mapping[Monomial, Node], atoms: list[Node], new: Expressions) -> Node:
    """The sum of coefficients times monomials, by increasing power of the last atom, then of the ones before it."""
    order = sorted(terms, key=lambda m: tuple(dict(m).get(atom, 0) for atom in reversed(atoms)))
    total = new.number(0.0)
    for monomial in order:
        term = terms[monomial]
        for node, power in sorted(monomial, key=lambda item: atoms.index(item[0])):
            factor = new.power(node, new.number(power))
            term = factor if is_number(term, 1.0) else new.product(term, factor)
        total = new.add(total, term)
    return total


def summands(node: Node) -> list[Node]:
    """The terms of a sum, in their order; any other node is one term."""
    terms: list[Node] = []
    while node.kind == ADD:
        node, last = node.arguments
        terms.append(last)
    return [node, *reversed(terms)]


def depends_on(root: Node, symbols: Collection[Node]) -> list[Node]:
    """The given symbols that occur in an expression, in their order."""
    present = set(in_order(root))
    return [symbol for symbol in symbols if symbol in present]
