"""Figure docs/images/fit.png of the first page: what its block of code draws. Run python
release/figures/make_front_figure.py
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from airmuscle.core.plotting import save

PAGE = Path(__file__).parents[1] / "book" / "index.md"
PICTURE = Path(__file__).parents[2] / "docs" / "images" / "fit.png"


def first_figure() -> Any:
    """The figure that the last line of the block returns."""
    found = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    *statements, figure = found[1].strip().splitlines()
    names: dict[str, Any] = {}
    exec(compile("\n".join(statements), PAGE.name, "exec"), names)
    return eval(figure, names)


def main(path: Path = PICTURE) -> None:
    """Write the figure."""
    save(first_figure(), path)
    print(f"wrote {path}")


if __name__ == "__main__":
    main()
