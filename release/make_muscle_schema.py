"""Schema docs/reference/muscle-schema.json of muscle files, from the declared models.

Run python release/make_muscle_schema.py
"""

from __future__ import annotations

import json
from pathlib import Path

from airmuscle.files import muscle_schema

PATH = Path(__file__).resolve().parents[1] / "docs" / "reference" / "muscle-schema.json"


def text() -> str:
    """The schema as text."""
    return json.dumps(muscle_schema(), indent=1, ensure_ascii=False) + "\n"


def main() -> None:
    """Write the schema."""
    PATH.write_text(text(), encoding="utf-8")
    print(f"wrote {PATH}")


if __name__ == "__main__":
    main()
