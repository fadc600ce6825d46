"""A damaged file is read or refused with a short message in airmuscle's own words: bytes of tables
and workbooks, and values, keys and bytes of TOML files, are replaced at random (seeded).
"""

from __future__ import annotations

import copy
import random
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, read
from airmuscle.errors import AirmuscleError
from airmuscle.files import library, load, load_scenario, load_valve

tomlkit = pytest.importorskip("tomlkit", reason="tomlkit is not installed")
LIBRARY = Path(library.__file__).parent
EXAMPLES = Path(__file__).parents[2] / "examples"
LONGEST = 2000
VALUES: tuple[Any, ...] = (
    0,
    -1,
    10**30,
    1e308,
    1e-308,
    float("inf"),
    float("nan"),
    True,
    "",
    " ",
    "x",
    "1",
    "5 bar",
    "-5 bar",
    "300 mm",
    "nan s",
    "5 furlong",
    "9**9**9 m",
    "a" * 3000,
    "\x1b[31m",
    "/dev/zero",
    "../x.toml",
    "Braid",
    "Valve",
    "dmsp-20-300",
    [],
    [[]],
    [1, 2],
    ["x"],
    [{}],
    {},
    {"model": "Braid"},
    {"model": 5},
    {"library": "x"},
    {"x": 1},
    [1] * 500,
    "chosen.x",
)
PARTS = (
    b"[",
    b"]",
    b"=",
    b'"',
    b"\n",
    b"'''",
    b",",
    b";",
    b"\xff",
    b"\0",
    b"#",
    b"nan",
    b"1e999",
    b"-",
    b"a" * 500,
)


def refused(call: Callable[[], object]) -> bool:
    """Whether a call is refused; an exception that is not airmuscle's own is one of the test."""
    said = None
    try:
        call()
    except AirmuscleError as error:
        said = str(error)
    assert said is None or 10 < len(said) < LONGEST, said[:500]
    return said is not None


def damaged(content: bytes, draw: random.Random) -> bytes:
    """The bytes with some of them replaced, left out or inserted."""
    changed = bytearray(content)
    for _ in range(draw.choice([1, 2, 5])):
        place = draw.randrange(len(changed))
        kind = draw.randrange(4)
        if kind == 0:
            changed[place] = draw.randrange(256)
        elif kind == 1:
            del changed[place : place + draw.choice([1, 3, 40])]
        elif kind == 2:
            changed[place:place] = draw.choice(PARTS)
        else:
            changed = (
                changed[: max(place, 1)]
                if draw.random() < 0.2
                else changed[:place] + changed[place // 2 :]
            )
    return bytes(changed)


def paths(node: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    for key, value in (
        node.items()
        if isinstance(node, dict)
        else enumerate(node)
        if isinstance(node, list)
        else ()
    ):
        yield (*at, key)
        yield from paths(value, (*at, key))


def changed(tree: dict[str, Any], draw: random.Random) -> str:
    """TOML with one value replaced, left out, or under another name."""
    tree = copy.deepcopy(tree)
    *parents, last = draw.choice(list(paths(tree)))
    node: Any = tree
    for key in parents:
        node = node[key]
    kind = draw.randrange(5)
    if kind <= 2:
        node[last] = draw.choice(VALUES)
    elif kind == 3 or isinstance(last, int):
        del node[last]
    else:
        node[f"{last}s"] = node.pop(last)
    return tomlkit.dumps(tree)


def table() -> bytes:
    rows = (f"{i},5;{100 + i % 9},5;{300 - i % 5};{200 + i}" for i in range(40))
    head = "# resting_length [mm] = 300\ntime [s];pressure [kPa];length [mm];force [N]"
    return "\n".join([head, *rows]).encode()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("count", [250, pytest.param(5000, marks=pytest.mark.slow)])
def test_a_damaged_table_of_text(tmp_path: Path, count: int):
    draw = random.Random(26)
    refusals = 0
    for _ in range(count):
        (tmp_path / "run.csv").write_bytes(damaged(table(), draw))
        refusals += refused(lambda: read(tmp_path / "run.csv"))
    assert 0.2 * count < refusals < count


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("count", [25, pytest.param(400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("suffix", ["mat", "xlsx"])
def test_a_damaged_binary_file(tmp_path: Path, suffix: str, count: int):
    path = tmp_path / f"run.{suffix}"
    columns = {
        "time": np.arange(30.0),
        "pressure": np.linspace(1e5, 2e5, 30),
        "force": np.linspace(0.0, 100.0, 30),
    }
    if suffix == "mat":
        pytest.importorskip("scipy.io").savemat(path, columns)
        mapping = ColumnMapping(units={"time": "s", "pressure": "Pa", "force": "N"})
    else:
        book = pytest.importorskip("openpyxl").Workbook()
        book.active.append(["time [s]", "pressure [Pa]", "force [N]"])
        for row in zip(*(each.tolist() for each in columns.values()), strict=True):
            book.active.append(row)
        book.save(path)
        mapping = ColumnMapping()
    content = path.read_bytes()
    draw = random.Random(26)
    assert not refused(lambda: read(path, mapping))
    refusals = 0
    for _ in range(count):
        path.write_bytes(damaged(content, draw))
        refusals += refused(lambda: read(path, mapping))
    assert refusals > 0.2 * count


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("count", [40, pytest.param(1500, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("source", "open_file"),
    [
        (LIBRARY / "dmsp-20-300.toml", load),
        (LIBRARY / "saga2007.toml", load),
        (sorted((LIBRARY / "valves").glob("*.toml"))[0], load_valve),
        (sorted((LIBRARY / "plants").glob("joint*.toml"))[0], load),
        (EXAMPLES / "fill_discharge.toml", load_scenario),
        (EXAMPLES / "pressure_loop.toml", load_scenario),
    ],
    ids=lambda each: getattr(each, "stem", getattr(each, "__name__", "")),
)
def test_a_toml_file_with_another_value_key_or_byte(
    tmp_path: Path, source: Path, open_file: Any, count: int
):
    path, text, draw = tmp_path / "m.toml", source.read_bytes(), random.Random(26)
    tree = tomllib.loads(text.decode())
    refusals = 0
    path.write_bytes(text)
    assert not refused(lambda: open_file(path))
    for i in range(count):
        path.write_bytes(
            damaged(text, draw)
            if i % 4 == 0
            else changed(tree, draw).encode("utf-8", "surrogatepass")
        )
        refusals += refused(lambda: open_file(path))
    assert 0.2 * count < refusals
