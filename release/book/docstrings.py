"""Docstrings as Markdown: summary, formulas and prose, with the formulas rendered."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Collection
from typing import Any, NamedTuple

from .ascii_math import FormulaError, to_latex
from .formulas_in_text import ARTICLES, WORDS_OF_FORMULAS, displayed, markdown, symbols_of

HEADLINE = re.compile(r"(?P<name>[^=]*?[\w)]): (?P<formula>\S.*=.*)", re.DOTALL)
"""Summary of a law: its name, a colon, its formula."""
FORMULA_FIRST = re.compile(r"[A-Za-z_^'(),0-9 -]{1,60}(?<![a-z]{4}) = ")
"""Beginning of a summary that is a formula itself, such as `u = K (r - y)`."""
REMARK = re.compile(
    r"[,;:.] +(?=(?P<word>[A-Za-z]+)(?![\w]* *[=(_^']))|"
    r" (?=(?P<after>with|by|at|for|where|in|so|constant)\b)"
)
"""Beginning of the prose behind a formula: a word after punctuation, or a preposition."""
ARGUMENT = re.compile(r"(?P<names>[a-z_]\w*(?:, [a-z_]\w*)*) {2,}(?P<meaning>\S.*)")
"""Line of a table of arguments: names, two spaces or more, meaning."""
REFERENCE = re.compile(r"\s*(?:References?): .*$", re.DOTALL)
"""Sentence that repeats the references of the class, which a page lists in full."""


class Parts(NamedTuple):
    """Parts of a docstring: its first paragraph and the blocks after it, prose or indented
    lines.
    """

    summary: str
    blocks: tuple[str, ...]


def parts(text: str) -> Parts:
    """The parts of a docstring; indented lines are blocks of their own."""
    blocks: list[str] = []
    for paragraph in re.split(r"\n\s*\n", text.strip("\n")):
        lines = paragraph.split("\n")
        if ARGUMENT.match(lines[0]):
            blocks.append(paragraph)
            continue
        group: list[str] = []
        for line in lines:
            if group and line.startswith("    ") != group[-1].startswith("    "):
                blocks.append("\n".join(group))
                group = []
            group.append(line)
        blocks.append("\n".join(group))
    return Parts(blocks[0], tuple(blocks[1:]))


def docstring(thing: Any) -> str:
    """The docstring of a class or function itself, without indentation; empty if it has none."""
    own = thing.__dict__.get("__doc__") if inspect.isclass(thing) else thing.__doc__
    return inspect.cleandoc(own) if own else ""


def to_markdown(text: str, symbols: Collection[str] = (), *, omit_references: bool = False) -> str:
    """A docstring as Markdown; `symbols` are letters that are always set as mathematics."""
    known = {*symbols, *symbols_of(text)}
    summary, blocks = parts(text)
    result = [headline(summary, known)]
    for block in blocks:
        if ARGUMENT.match(block):
            result.append(arguments(block, known))
        elif block.startswith("    "):
            result.append(indented(block))
        else:
            prose = REFERENCE.sub("", block) if omit_references else block
            result.append(markdown(prose, known))
    return "\n\n".join(part for part in result if part.strip()) + "\n"


def arguments(block: str, symbols: Collection[str]) -> str:
    """The arguments of a function, one a line with its meaning, as a list."""
    entries: list[tuple[str, str]] = []
    for line in block.split("\n"):
        match = ARGUMENT.match(line)
        if match:
            entries.append((match["names"], match["meaning"]))
        else:
            entries[-1] = (entries[-1][0], f"{entries[-1][1]} {line.strip()}")
    return "\n".join(f"* `{name}`: {markdown(meaning, symbols)}" for name, meaning in entries)


def headline(summary: str, symbols: Collection[str]) -> str:
    """The summary of a law: its name, and its formula displayed below it."""
    text = " ".join(summary.split("\n"))
    match = HEADLINE.fullmatch(text)
    name, formula = (
        (match["name"], match["formula"])
        if match
        else ("", text if FORMULA_FIRST.match(text) else "")
    )
    if not formula:
        return markdown(text, symbols)
    formula, remark = split_remark(formula)
    if not formula:
        return markdown(text, symbols)
    equations = [
        part for part in re.split(r"(?<=[\])\w]),?;? {2,}(?![^(]*\))", formula) if part.strip()
    ]
    try:
        body = displayed(equations)
    except FormulaError:
        return markdown(text, symbols)
    end = markdown(remark, symbols) if remark else ""
    return "\n\n".join(
        part for part in (markdown(name, symbols) + "." if name else "", body, end) if part
    )


def split_remark(formula: str) -> tuple[str, str]:
    """A formula and the prose that follows it in the same sentence."""
    for match in REMARK.finditer(formula):
        word = match["word"] or match["after"]
        if match["after"] or not (
            word in WORDS_OF_FORMULAS or (len(word) == 1 and word not in ARTICLES)
        ):
            return formula[: match.start()].rstrip(",;:. "), formula[match.end() :]
    return formula.rstrip("."), ""


def indented(block: str) -> str:
    """Indented lines of a docstring: formulas if all of them are, otherwise code."""
    text = textwrap.dedent(block)
    try:
        if re.search(r"[=<>≤≥]", text):
            return displayed(joined_lines(text))
    except FormulaError:
        pass  # not a formula
    return f"```text\n{text}\n```"


def joined_lines(text: str) -> list[str]:
    """Lines of formulas; a line that continues the one before it is joined to it."""
    lines: list[str] = []
    for line in text.split("\n"):
        if lines and re.match(r"\s*(?:u_min <=|[+\-*/]\s)", line):
            lines[-1] += " " + line.strip()
        else:
            lines.append(re.sub(r" {2,}=", " =", line.strip()))
    return lines


def symbol(text: str) -> str:
    """A declared symbol such as eps_0 as inline mathematics; other labels unchanged."""
    try:
        return f"{{math}}`{to_latex(text, display=False)}`"
    except FormulaError:
        return text
