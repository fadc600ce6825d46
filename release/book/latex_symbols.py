"""Names in formulas as LaTeX: Greek letters, indices, differentials and words."""

from __future__ import annotations

import re

GREEK = frozenset(
    [
        "alpha",
        "beta",
        "gamma",
        "delta",
        "zeta",
        "eta",
        "theta",
        "kappa",
        "lambda",
        "mu",
        "nu",
        "xi",
        "pi",
        "rho",
        "sigma",
        "tau",
        "phi",
        "psi",
        "omega",
        "Delta",
        "Gamma",
        "Omega",
        "Phi",
        "Theta",
    ]
)
DIFFERENTIAL = re.compile(rf"d(?:[A-Z]|[a-z]|eps|{'|'.join(sorted(GREEK))})")
"""A differential such as dV; it stands beside a solidus or closes an integral."""


def symbol(text: str) -> str:
    """LaTeX of a name: a Greek letter, a letter with a number as index, a differential, or a word
    set upright.
    """
    if text in GREEK:
        return rf"\{text} "
    if text in ("eps", "epsilon"):
        return r"\varepsilon "
    if text == "infinity":
        return r"\infty"
    if len(text) == 1 or not text.isascii():
        return text
    if DIFFERENTIAL.fullmatch(text):
        return rf"\mathrm{{d}}{symbol(text[1:])}"
    if match := re.fullmatch(r"([A-Za-z]|rho|theta|mu)(\d+)", text):
        return f"{symbol(match[1])}_{{{match[2]}}}"
    return {"qm": r"q_\mathrm{m}", "hA": "h A", "Re": r"\mathrm{Re}"}.get(text, rf"\text{{{text}}}")


def index_of(text: str) -> str:
    """LaTeX of an index: counting letters and Greek names as symbols, abbreviations upright."""
    if re.fullmatch(r"[\d.]+|[a-z]|[ijkn]{2}|\d[ijkn]", text):
        return text
    if text in GREEK or text == "eps":
        return symbol(text).strip()
    if len(text) == 2 and text[0].islower() and text[1] in "ijk":  # l_ci
        return rf"\mathrm{{{text[0]}}}{text[1]}"
    return rf"\text{{{text}}}" if len(text) > 1 else text
