"""Names of the values of a list in a table of parameters."""

from __future__ import annotations

from collections.abc import Sequence


def continues_list(names: Sequence[str]) -> list[bool]:
    """Whether each name is a further value of the list before it, as coefficients[1] below coefficients[0].

    Tables state the meaning of a list once.
    """
    stems = [name.partition("[")[0] for name in names]
    return [i > 0 and stems[i - 1] == stem and "[" in names[i] for i, stem in enumerate(stems)]
