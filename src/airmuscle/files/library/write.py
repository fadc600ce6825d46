"""Writing of library entries, model tables and scenarios as TOML that the loaders read back to the same numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.atomic_output import atomic_file
from ...core.errors import FileError
from .build import TEXT_KEYS
from .entry import OPTIONAL_PARTS, Check, Entry
from .saved_entry import Savable, entry_of
from .uncertainty import uncertainty_table


def to_toml(entry: Entry) -> str:
    """Text of the library file of an entry; numbers in SI units with all digits."""
    tables: dict[str, Any] = {key: getattr(entry, key) for key in TEXT_KEYS if getattr(entry, key)}
    for part in ("characteristic", "geometry", *OPTIONAL_PARTS):
        thing = getattr(entry, part)
        belongs_to_law = part == "geometry" and thing == getattr(entry.characteristic, "geometry", None)
        if thing is not None and not belongs_to_law:
            tables[part] = model_table(thing)
    if entry.ratings is not None:
        tables["ratings"] = {name: getattr(entry.ratings, name) for name in entry.ratings.stated}
    if entry.validity_range is not None:
        tables["validity_range"] = dataclasses.asdict(entry.validity_range)
    if entry.uncertainty is not None:
        tables["uncertainty"] = uncertainty_table(entry.uncertainty)
    if entry.error_band is not None:
        stated = dataclasses.asdict(entry.error_band)
        tables["error_band"] = {key: value for key, value in stated.items() if value not in (None, (), "")}
    if entry.checks:
        tables["check"] = [_check_table(check) for check in entry.checks]
    if entry.references:
        tables["reference"] = [
            {key: value for key, value in dataclasses.asdict(reference).items() if value not in (None, "")}
            for reference in entry.references
        ]
    return _to_text(tables)


def part_toml(name: str, thing: Any) -> str:
    """Text of one table of a library file, such as [friction], with the model and its parameters."""
    return _to_text({name: model_table(thing)})


def tables_toml(tables: Mapping[str, Any]) -> str:
    """Text of tables of plain values."""
    return _to_text(tables)


def scenario_toml(
    title: str, plant: Any, input_table: Mapping[str, Any], run: Mapping[str, Any], note: str = "",
    fitted: Mapping[str, Any] | None = None,
) -> str:  # fmt: skip
    """Text of a scenario that `load_scenario` reads: a plant with all parameters, the command and run tables.

    Each line of `note` becomes a comment at the beginning; `fitted` are the tables [observed] and [uncertainty] of the
    fit of the plant.
    """
    comments = "".join(f"# {line}\n" for line in note.splitlines())
    return comments + _to_text(
        {"title": title, "plant": model_table(plant), "input": input_table, "run": run, **(fitted or {})}
    )


def save(entry: Savable, path: str | Path) -> Path:
    """Write a muscle, a characteristic, a fit or a library entry to a muscle file that `load` reads.

    The file is complete or unchanged. The fit of a law without a geometry gives a characteristic; for a muscle, write
    `Muscle(fit.model, geometry)`. Raises FileError, and ParameterError for anything else.
    """
    entry = entry_of(entry)
    if not isinstance(path, str | Path):
        raise FileError(f"save: {path!r} is not a path; give a text or a Path.")
    return write_text(Path(path), to_toml(entry))


def write_text(path: Path, text: str) -> Path:
    """Write a text to a file, which is complete or unchanged; line ends are those of the text. Raises FileError."""
    try:
        with atomic_file(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="")
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror}). Name a file in a writable folder.") from None
    return path


def _to_text(tables: Mapping[str, Any]) -> str:
    import tomlkit

    return tomlkit.dumps(_plain(tables))


def model_table(thing: Any) -> dict[str, Any]:
    """A model as the table that `build` reads; fields that are None have this default and are left out."""
    fields = {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing) if f.init}
    return {
        "model": type(thing).__name__,
        **{name: value for name, value in fields.items() if value is not None},
    }


def _check_table(check: Check) -> dict[str, Any]:
    return {"quantity": check.quantity, **dict(check.conditions), "equals": check.equals,
            "tolerance": check.tolerance, "source": check.source}  # fmt: skip


def _plain(value: Any) -> Any:
    """Models as tables, tuples as lists, NumPy numbers as floats; in a table, values stand before inner tables."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _plain(model_table(value))
    if isinstance(value, Mapping):
        plain = {key: _plain(item) for key, item in value.items()}
        return dict(sorted(plain.items(), key=lambda item: _is_table(item[1])))
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | bool | int) else float(value)


def _is_table(value: Any) -> bool:
    """Whether TOML writes a value as a table or an array of tables."""
    return isinstance(value, dict) or (isinstance(value, list) and any(isinstance(item, dict) for item in value))
