"""Formulas of docstrings and pages: plain text such as `F = p b^2/(4 pi n^2)` as LaTeX.

Grammar: products by spaces, quotients by `/`, powers by `^`, indices by `_`, primes, sums and
integrals with limits, `|x|`, Greek letters by name, differentials (`dV`), the functions of
FUNCTIONS, relations. Other words are set upright.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from .latex_symbols import index_of, symbol

FUNCTIONS = frozenset(
    ["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "ln", "log", "max", "min"]
)
WORD_FUNCTIONS = frozenset(["asinh", "atan", "clip", "clamp", "sat", "sign", "sgn", "floor", "erf"])
SUMS = {"Sum": r"\sum", "sum": r"\sum", "Int": r"\int", "integral": r"\int"}
SIGNS = {
    "<=": r"\le",
    ">=": r"\ge",
    "->": r"\to",
    "...": r"\ldots",
    "..": r"\ldots",
    "=": "=",
    "<": "<",
    ">": ">",
    "+": "+",
    "-": "-",
    ",": ",",
    ";": ";",
    ":": ":",
    "≤": r"\le",
    "≥": r"\ge",
    "≈": r"\approx",
    "−": "-",
    "½": r"\tfrac12",
    "←": r"\leftarrow",
    "*": r"\cdot",
    "%": r"\%",
    "infinity": r"\infty",
}
RELATIONS = frozenset(["=", "<", ">", "<=", ">=", "->", "≤", "≥", "≈", "←"])
OPENING = {"(": "(", "[": "[", "{": r"\{"}
CLOSING = {")": ")", "]": "]", "}": r"\}"}
TOKEN = re.compile(
    r"(?P<gap> {2,})|(?P<space> )"
    r"|(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![A-Za-z_]))"
    r"|(?P<name>[^\W\d_][^\W_]*)"
    r"|(?P<sign><=|>=|->|\.\.\.|\.\.|[=<>+\-,;:≤≥≈−½←*%])"
    r"|(?P<mark>['^_/|()\[\]{}.])"
)


class FormulaError(ValueError):
    """A text that is no formula."""


class Token(NamedTuple):
    """One token: its kind, its text, and whether a space is in front of it."""

    kind: str
    text: str
    spaced: bool


def tokenise(text: str) -> list[Token]:
    """Tokens of a formula. Raises FormulaError at a character that no formula contains."""
    tokens = []
    end = 0
    spaced = False
    while end < len(text):
        match = TOKEN.match(text, end)
        if match is None:
            raise FormulaError(f"{text!r}: character {text[end]!r}")
        end = match.end()
        kind = str(match.lastgroup)
        if kind != "space":
            tokens.append(Token(kind, match[0], spaced))
        spaced = kind in ("space", "gap")
    return tokens


def to_latex(text: str, display: bool = True) -> str:
    """LaTeX of a formula; quotients are fractions if it is displayed. Raises FormulaError if
    brackets do not match.
    """
    differentials = re.sub(
        r"\bd (\w+)/d (\w+)", r"d\1/d\2", re.sub(r"\bd\((\w+)\)/d", r"d\1/d", text.strip())
    )
    indices = re.sub(r"\b([A-Za-z])(\d)_(\w)", r"\1_(\2, \3)", differentials)  # L0_1
    return _Formula(tokenise(indices), display).read()


class _Formula:
    """Reader of the tokens of one formula."""

    def __init__(self, tokens: list[Token], display: bool) -> None:
        self.tokens = tokens
        self.display = display
        self.at = 0
        self.bars = 0

    def peek(self, ahead: int = 0) -> Token:
        index = self.at + ahead
        return self.tokens[index] if index < len(self.tokens) else Token("end", "", False)

    def next(self) -> Token:
        token = self.peek()
        self.at += 1
        return token

    def read(self) -> str:
        latex = self.sequence("")
        if self.peek().kind != "end":
            raise FormulaError(f"unmatched {self.peek().text!r}")
        return latex

    def sequence(self, closing: str) -> str:
        """Factors, signs and words up to `closing`, which is not consumed."""
        parts: list[str] = []
        while (token := self.peek()).kind != "end" and token.text not in CLOSING:
            if closing == "|" and token.text == "|":
                break
            parts.append(self.element())
        if closing and self.peek().text != closing:
            raise FormulaError(f"no {closing!r} before {self.peek().text!r}")
        return _with_words([part for part in parts if part])

    def element(self) -> str:
        token = self.peek()
        if token.kind == "gap":
            self.next()
            return r"\quad"
        if token.kind == "sign":
            self.next()
            return SIGNS[token.text]
        if token.text == "/":
            raise FormulaError("a quotient without numerator")
        if token.text == ".":
            self.next()
            return "." if self.peek().kind != "end" else ""
        return self.quotient()

    def quotient(self) -> str:
        """A factor, or several divided by one another."""
        start = self.at
        latex = self.factor()
        while self.peek().text == "/" and self.peek(1).kind != "end":
            bare = self.without_brackets(start, latex)
            over = self.at
            self.next()
            below = self.at
            divisor = self.factor()
            if self.display:
                latex = rf"\frac{{{bare}}}{{{self.without_brackets(below, divisor)}}}"
            else:
                latex = f"{latex}/{divisor}"
            start = over  # a second solidus divides the whole fraction
        return latex

    def without_brackets(self, start: int, latex: str) -> str:
        """The LaTeX of a factor; a pair of brackets around the whole of it is omitted."""
        if (
            latex.startswith((r"\left(", r"\left["))
            and latex.endswith((r"\right)", r"\right]"))
            and self.encloses(start)
        ):
            return latex[len(r"\left(") : -len(r"\right)")].strip()
        return latex

    def encloses(self, start: int) -> bool:
        """Whether the bracket at `start` closes with the token just read."""
        depth = 0
        for index in range(start, self.at):
            depth += (self.tokens[index].text in ("(", "[")) - (
                self.tokens[index].text in (")", "]")
            )
            if depth == 0:
                return index == self.at - 1
        return False

    def factor(self) -> str:
        """A name, number or bracket with its indices, powers and primes."""
        token = self.next()
        if token.text in OPENING:
            inner = self.sequence({"(": ")", "[": "]", "{": "}"}[token.text])
            latex = rf"\left{OPENING[token.text]} {inner} \right{CLOSING[self.next().text]}"
        elif token.text == "|":
            if self.peek().spaced and token.spaced:
                return r"\mid"
            latex = rf"\left| {self.sequence('|')} \right|"
            self.next()
        elif token.kind == "number":
            latex = self.number(token.text)
        elif token.kind == "name":
            latex = self.name(token.text)
        elif token.text == "-" or token.text == "−":
            return "-" + self.factor()
        else:
            raise FormulaError(f"unexpected {token.text!r}")
        latex += self.attached()
        if token.kind == "name" and self.peek().text in ("(", "[") and not self.peek().spaced:
            latex += self.factor()  # arguments of a function of the formula, such as s(p)
        return latex

    @staticmethod
    def number(text: str) -> str:
        mantissa, _, exponent = text.partition("e")
        return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa

    def name(self, text: str) -> str:
        if text in SUMS and text != "integral":
            return SUMS[text]
        if text == "sqrt":
            return self.root()
        if text in FUNCTIONS or text in WORD_FUNCTIONS:
            return self.applied(rf"\{text}" if text in FUNCTIONS else rf"\operatorname{{{text}}}")
        return symbol(text)

    def applied(self, function: str) -> str:
        """A function with its power and its argument, which needs no brackets."""
        latex = function + self.attached()
        following = self.peek()
        if following.kind in ("name", "number") or following.text in ("(", "[", "|"):
            latex += " " + self.factor()
        return latex

    def root(self) -> str:
        start = self.at
        bare = self.without_brackets(start, self.factor())
        return rf"\sqrt{{{bare}}}"

    def attached(self) -> str:
        """Primes, indices and powers behind a factor."""
        primes = ""
        index = ""
        power = ""
        while True:
            token = self.peek()
            if token.text == "'" and not token.spaced:
                self.next()
                primes += "'"
            elif token.text == "_" and not token.spaced:
                self.next()
                index = f"{index}, {self.script(True)}" if index else self.script(True)
            elif token.text == "^":
                self.next()
                power = self.script(False)
            elif token.kind == "name" and primes and not token.spaced:  # P_r'i
                index = f"{index} {index_of(self.next().text)}"
            else:
                break
        latex = primes if not power else (f"'^{{{power}}}" if primes else f"^{{{power}}}")
        return (f"_{{{index}}}" if index else "") + latex

    def script(self, index: bool) -> str:
        """The index or exponent that follows."""
        token = self.peek()
        if token.text in OPENING:
            start = self.at
            latex = self.factor_without_scripts()
            return self.strip_brackets(latex) if self.tokens[start].text in "({" else latex
        if token.text in ("-", "−", "+"):
            self.next()
            following = self.peek()
            joined = following.kind in ("number", "name") and not following.spaced
            return token.text.replace("−", "-") + (self.script(index) if joined else "")
        self.next()
        if token.kind not in ("number", "name"):
            raise FormulaError(f"unexpected index or power {token.text!r}")
        return index_of(token.text) if index or token.kind == "number" else symbol(token.text)

    def factor_without_scripts(self) -> str:
        token = self.next()
        inner = self.sequence({"(": ")", "[": "]", "{": "}"}[token.text])
        return rf"\left{OPENING[token.text]} {inner} \right{CLOSING[self.next().text]}"

    @staticmethod
    def strip_brackets(latex: str) -> str:
        return re.sub(r"^\\left(\(|\\\{) (.*) \\right(\)|\\\})$", r"\2", latex)


def _with_words(parts: list[str]) -> str:
    """The parts of a sequence; words in it are joined, with spaces around them."""
    words = re.compile(r"\\text\{([^{}]{2,})\}")
    joined: list[str] = []
    for part in parts:
        word = words.fullmatch(part)
        before = words.fullmatch(joined[-1]) if joined else None
        if word and before:
            joined[-1] = rf"\text{{{before[1].rstrip()} {word[1]} }}"
        else:
            joined.append(rf"\text{{ {word[1]} }}" if word else part)
    return " ".join(joined)
