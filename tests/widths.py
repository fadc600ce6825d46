"""Cases of a claim: those that differ in kind run by default, the further ones, which widen it,
with the slow tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import pytest

SAME_LAW = {
    "borzikova-direct-repaired",
    "borzikova-monotone",
    "dmsp-10-250",
    "festo-tool-dmsp-20",
    "festo-tool-dmsp-40",
    "sarosi-dmsp-20-200n",
    "sarosi-dmsp-20-400n",
}
"""Entries of the library whose law is that of another entry, with other numbers."""


def widened(cases: Iterable[Any], by_default: Callable[..., bool]) -> list[Any]:
    """The parameter sets of a test; those that `by_default` rejects are slow. A tuple is one set of
    several arguments.
    """
    sets = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [
        pytest.param(*values, marks=() if by_default(*values) else pytest.mark.slow)
        for values in sets
    ]
