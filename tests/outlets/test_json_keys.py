"""The page on the keys of `--json` lists what commands print (each test that reads JSON checks it),
and nothing else.
"""

import ast
import json
import re
from pathlib import Path

import pytest
from json_keys import COMMON, documented, undocumented

import airmuscle
from airmuscle.outlets.cli import COMMANDS
from airmuscle.report import Chapter, NamedValue, Table, as_data

SOURCE = Path(airmuscle.__file__).parent


def test_each_listed_name_is_written_in_the_source():
    """A name that was changed or removed is found here."""
    texts = {
        node.value
        for path in SOURCE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and len(node.value) < 60
    }
    known = {re.sub(r"[^\w.\[\]]+", "_", text).strip("_") for text in texts}
    ends = tuple(each for each in known if len(each) > 3)
    listed = {chapter.removesuffix("_N") for chapter in documented()}
    for tables in documented().values():
        listed |= {key for key in tables if key} | {
            each for columns in tables.values() for each in columns or ()
        }
    composed = {name for name in listed - known if name.startswith(ends) or name.endswith(ends)}
    assert listed - known - composed == set()


def test_a_key_that_is_not_listed_is_named():
    def answer(value: str, column: str, chapter: str = "fit") -> dict:
        table = Table("parameters", "Parameters", {column: [1.0]})
        return json.loads(
            json.dumps(
                as_data(
                    [Chapter(chapter, "t", "s", values=(NamedValue(value, 1.0),), tables=(table,))]
                )
            )
        )

    assert undocumented(answer("rms error", "value")) == []
    assert undocumented(answer("new value", "value")) == ["fit.new_value"]
    assert undocumented(answer("rms error", "new column")) == ["fit.parameters.new_column"]
    assert undocumented(answer("rms error", "value", "new")) == ["new.*"]


@pytest.mark.parametrize("name", sorted(documented()))
def test_the_commands_of_a_chapter_exist(name: str):
    page = (Path(__file__).resolve().parents[2] / "docs" / "reference/json-keys.md").read_text(
        encoding="utf-8"
    )
    line = page.split(f"\n## `{name}`\n\nOf ")[1].split("\n")[0]
    assert set(re.findall(r"`([a-z-]+)`", line)) <= {row.name for row in COMMANDS}
    assert not COMMON & set(documented()[name])
