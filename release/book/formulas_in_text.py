"""Formulas within prose: docstrings and indented blocks of pages as Markdown with rendered
formulas.

A formula of a docstring is a sequence of mathematical tokens that contains a relation, or a single
symbol with an index or a Greek name. Prose between them remains, with the characters escaped that
Markdown would interpret.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

from .ascii_math import FUNCTIONS, RELATIONS, SUMS, WORD_FUNCTIONS, FormulaError, to_latex
from .latex_symbols import GREEK

PIECE = re.compile(
    r"(?P<code>`[^`]+`)|(?P<space>\s+)"
    r"|(?P<unit>(?<=\s)\[[^\]+=]{0,20}\](?=[\s.,;:)]|$)|(?<!\w)(?:N/mm|N s/m|N"
    r" m/rad|rad/s|m/s|W/K|l/min)(?!\w))"
    r"|(?P<equation>(?<![\w)])\(\d+[a-z]?\)(?:[-–]\(\d+\))?)"
    r"|(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![A-Za-z_\d]))"
    r"|(?P<name>[^\W\d_][^\W_]*(?:-[^\W\d_]{2,})*)"
    r"|(?P<relation><=|>=|->|[=<>≤≥≈])"
    r"|(?P<sign>\.\.\.|\.\.|[+*/^_'|−-])|(?P<open>[(\[{])|(?P<close>[)\]}])|(?P<stop>[,;:.])|(?P<other>.)"
)
ARTICLES = ("a", "A", "I")
WORDS_OF_FORMULAS = (
    FUNCTIONS
    | WORD_FUNCTIONS
    | GREEK
    | {"sqrt", "eps", "qm", "hA", "Re", *SUMS} - {"sum", "integral"}
)
ESCAPED = re.compile(r"([\\*_<>\[\]|#$])")
Pieces = list[tuple[str, str]]


def escape(prose: str) -> str:
    """Prose for Markdown."""
    return ESCAPED.sub(r"\\\1", prose)


def symbols_of(text: str) -> frozenset[str]:
    """Single letters that stand beside a sign of a formula, and are therefore symbols of it."""
    found = re.findall(r"(?<![\w.])([A-Za-z])'*(?=\s*[=(^/_\[]|:\s|\s[-+]\s|_\w)", text)
    after = re.findall(r"[=/(+*^]\s*([A-Za-z])\b(?![\w.-])", text)
    differentials = re.findall(r"\bd([A-Z])/", text)
    return frozenset(found + after + differentials) - {"A", "I"}


def markdown(paragraph: str, symbols: Collection[str] = ()) -> str:
    """A paragraph with its formulas as mathematics; `symbols` are letters that are set as such also
    alone.
    """
    text = " ".join(paragraph.split()) if "  " not in paragraph else paragraph.replace("\n", " ")
    pieces: Pieces = [(str(match.lastgroup), match[0]) for match in PIECE.finditer(text)]
    result = []
    for formula, run in _runs(pieces, symbols):
        result.append(_rendered(run, symbols) if formula else _prose(run))
    return "".join(result)


def _prose(run: Pieces) -> str:
    return "".join(text if kind == "code" else escape(text) for kind, text in run)


def _rendered(run: Pieces, symbols: Collection[str]) -> str:
    """A run of mathematical tokens, without the punctuation around it, as a formula if it is
    one.
    """
    first = 0
    last = len(run)
    while first < last and run[first][0] in ("space", "stop", "close"):
        first += 1
    while last > first and (
        run[last - 1][0] in ("space", "stop", "open") or run[last - 1][1] in "+-/"
    ):
        last -= 1
    while first < last and run[first][0] == "open" and not _balanced(run[first:last]):
        first += 1
    if (
        run[first:last]
        and run[first][1] == "("
        and run[last - 1][1] == ")"
        and _is_remark(run[first + 1 : last - 1])
    ):
        first = first + 1
        last = last - 1
    body = _balanced(run[first:last])
    first_text = _prose(run[:first])
    last_text = _prose(run[first + len(body) :])
    text = "".join(piece for _, piece in body)
    if not _is_formula(body, symbols):
        return _prose(run)
    try:
        return f"{first_text}{{math}}`{to_latex(text, display=False)}`{last_text}"
    except FormulaError:
        return _prose(run)


def _is_remark(inside: Pieces) -> bool:
    """Whether a run in brackets is an equation in brackets, whose brackets belong to the prose."""
    return any(kind == "relation" for kind, _ in inside) and _balanced(inside) == inside


def _balanced(run: Pieces) -> Pieces:
    """The longest beginning of a run whose brackets match."""
    depth = 0
    end = 0
    for index, (kind, _) in enumerate(run, 1):
        depth += (kind == "open") - (kind == "close")
        if depth < 0:
            break
        if depth == 0:
            end = index
    body = run[:end]
    while body and body[-1][0] in ("space", "stop"):
        body = body[:-1]
    return body


def _is_formula(run: Pieces, symbols: Collection[str]) -> bool:
    names = [text for kind, text in run if kind == "name"]
    texts = [text for _, text in run]
    if not names:
        return False
    if any(kind == "relation" for kind, _ in run):
        return len(run) > 2
    indexed = "_" in texts or any(name in GREEK or name in ("eps", "qm") for name in names)
    if len(run) == 1:
        return indexed or names[0] in symbols or bool(re.fullmatch(r"[A-Za-z]\d", names[0]))
    return (
        indexed
        or any(sign in texts for sign in ("^", "/", "+", "'"))
        or all(name in symbols for name in names)
    )


def _runs(pieces: Pieces, symbols: Collection[str]) -> Iterator[tuple[bool, Pieces]]:
    """Runs of mathematical tokens (True) and of prose (False), in order."""
    run: Pieces = []
    mathematical = False
    for index, (kind, text) in enumerate(pieces):
        now = mathematical if kind == "space" else _is_mathematical(pieces, index, symbols)
        if kind == "stop" and mathematical:
            now = _continues(run, pieces[index:], symbols)
        if now != mathematical and run:
            yield mathematical, run
            run = []
        mathematical = now
        run.append((kind, text))
    yield mathematical, run


def _continues(run: Pieces, rest: Pieces, symbols: Collection[str]) -> bool:
    """Whether the comma at the beginning of `rest` separates arguments within brackets of the run
    before it.
    """
    depth = sum((kind == "open") - (kind == "close") for kind, _ in run)
    if (
        rest[0][1] not in (",", ";")
        or len(rest) < 3
        or depth <= 0
        or not any(kind == "name" for kind, _ in run)
    ):
        return False
    return _is_mathematical(rest, 2, symbols) and _is_mathematical(
        rest, min(3, len(rest) - 1), symbols
    ) | (rest[min(3, len(rest) - 1)][0] in ("space", "close", "stop"))


def _is_mathematical(pieces: Pieces, index: int, symbols: Collection[str]) -> bool:
    kind, text = pieces[index]
    if kind in ("relation", "sign", "open", "close", "number"):
        return True
    if kind != "name":
        return False
    following = pieces[index + 1][1] if index + 1 < len(pieces) else ""
    if len(text) == 1:
        return (
            text not in ARTICLES or following in ("_", "^", "/", ":") or _beside_sign(pieces, index)
        )
    indexed = following == "_" and len(text) <= 2
    if following == "_" and text in FUNCTIONS:
        return False  # a name of the code, such as min_angle
    if text in WORDS_OF_FORMULAS or indexed or re.fullmatch(r"[A-Za-z]\d+|rho\d", text):
        return True
    before = pieces[index - 1][1] if index else ""
    if re.fullmatch(r"d(?:[A-Za-z]|eps|theta|phi)", text):
        return "/" in (before, following) or bool(re.fullmatch(r"d[A-Zrtsxv]", text))
    return before == "_"


def _beside_sign(pieces: Pieces, index: int) -> bool:
    """Whether a letter that is also an article stands beside a sign, a relation or the end of a
    bracket.
    """
    behind = [piece for piece in pieces[index + 1 : index + 3] if piece[0] != "space"][:1]
    before = [piece for piece in pieces[max(0, index - 2) : index] if piece[0] != "space"][-1:]
    signs = ("relation", "sign")
    if (
        behind
        and behind[0][0] == "name"
        and behind[0][1] not in WORDS_OF_FORMULAS
        and len(behind[0][1]) > 3
    ):
        return False
    closed = bool(behind and before) and behind[0][0] == "close" and before[0][0] == "name"
    return closed or any(kind in signs for kind, _ in [*before, *behind])


def displayed(lines: Collection[str]) -> str:
    """Lines of formulas as displayed mathematics. Raises FormulaError if one is no formula."""
    blocks = [
        f"```{{math}}\n{to_latex(line.rstrip(',. '))}\n```\n" for line in lines if line.strip()
    ]
    return "\n".join(blocks)


def is_formula_block(lines: Collection[str]) -> bool:
    """Whether an indented block of a page contains formulas only: no quotes, commands or file
    names.
    """
    text = "\n".join(lines)
    if re.search(r"[\"`$#@\\]|--|\.(?:toml|py|csv|html|md)\b|^\s*\[\w+\]\s*$", text, re.MULTILINE):
        return False
    relations = sum(any(f" {sign} " in line for sign in RELATIONS) for line in lines)
    words = len(re.findall(r"[A-Za-z]{4,}", text))
    if relations * 2 < len(lines) or words > 12 * max(1, len(lines)):
        return False
    try:
        displayed(lines)
    except FormulaError:
        return False
    return True
