"""An entry in the library's own form: what `load` reads back to the same numbers."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..core.errors import FileError, ParameterError
from .entry import OPTIONAL_PARTS, Check, Entry


def to_toml(entry: Entry) -> str:
    """The text of a library file for this entry; numbers in SI, with all their digits."""
    texts = {key: getattr(entry, key) for key in ("title", "provenance", "note", "warning")}
    lines = [f"{key} = {_value(text)}" for key, text in texts.items() if text]
    for part in ("characteristic", "geometry", *OPTIONAL_PARTS):
        built = getattr(entry, part)
        belongs_to_law = part == "geometry" and built == getattr(entry.characteristic, "geometry", None)
        if built is not None and not belongs_to_law:
            lines += part_toml(part, built)
    if entry.validity_range is not None:
        lines += _table("validity_range", dataclasses.asdict(entry.validity_range))
    for check in entry.checks:
        lines += _table("[check]", _row(check))
    for reference in entry.references:
        lines += _table("[reference]", {k: v for k, v in dataclasses.asdict(reference).items() if v not in (None, "")})
    return "\n".join(lines) + "\n"


def part_toml(name: str, thing: Any) -> list[str]:
    """The lines of one table of such a file: [friction], say, with the model and its numbers."""
    return list(_table(name, _described(thing)))


def scenario_toml(title: str, plant: Any, command: Mapping[str, Any], run: Mapping[str, Any], note: str = "") -> str:
    """The text of a scenario that `load_scenario` reads back: a plant with all its numbers, a command as written."""
    lines = [f"# {line}" for line in note.splitlines()]
    lines += [f"title = {_value(title)}", *_table("plant", _described(plant))]
    lines += [*_table("command", command), *_table("run", run)]
    return "\n".join(lines) + "\n"


def save(entry: Entry, path: str | Path) -> Path:
    """Write an entry to a file that `load` reads back, whole or not at all. Raises FileError."""
    if not isinstance(entry, Entry):
        raise ParameterError(f"save: {str(entry)[:80]} is no library entry; build one with Entry, or load and replace.")
    if not isinstance(path, str | Path):
        raise FileError(f"save: {path!r} is no path; name a file.")
    path = Path(path)
    unfinished = path.with_name(f"{path.name}.part")
    try:
        unfinished.write_text(to_toml(entry), encoding="utf-8")
        unfinished.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            unfinished.unlink()
        raise FileError(f"{path}: cannot be written ({error.strerror}).") from None
    return path


def _described(thing: Any) -> dict[str, Any]:
    """A model as the table that `build` reads; fields that are None are left out, being their default."""
    fields = {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing) if f.init}
    return {"model": type(thing).__name__, **{k: _structured(v) for k, v in fields.items() if v is not None}}


def _structured(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _described(value)
    return [_structured(v) for v in value] if isinstance(value, tuple) else value


def _row(check: Check) -> dict[str, Any]:
    return {"quantity": check.quantity, **dict(check.conditions), "equals": check.equals,
            "tolerance": check.tolerance, "source": check.source}  # fmt: skip


def _table(name: str, values: Mapping[str, Any]) -> Iterator[str]:
    """A table's lines, its plain values first, then the tables inside it."""
    yield f"\n[{name}]"
    yield from (f"{key} = {_value(value)}" for key, value in values.items() if not isinstance(value, Mapping))
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _table(f"{name}.{key}", value)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(v)}" for key, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return json.dumps(value) if isinstance(value, bool | int) else repr(float(value))
