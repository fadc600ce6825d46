"""Tables in Markdown."""

from __future__ import annotations

import re
from collections.abc import Sequence


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; vertical bars in cells are escaped once."""

    def line(cells: Sequence[str]) -> str:
        return (
            "| "
            + " | ".join(re.sub(r"(?<!\\)\|", r"\\|", cell).replace("\n", " ") for cell in cells)
            + " |"
        )

    return "\n".join([line(header), line(["---"] * len(header)), *map(line, rows), ""])
