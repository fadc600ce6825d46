"""Writing of library entries, model tables and scenarios as TOML that the loaders read back to the
same numbers.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from ... import physics
from ...bench.statics import Fit
from ...core import FileError, ParameterError, Reference, abridged, atomic_file, one_line
from ...physics import Characteristic, Ratings, ValidityRange
from .check import Check
from .entry import OPTIONAL_PARTS, Entry
from .fields import model_name
from .file_format import FORMAT, FORMAT_KEY
from .fitted_entry import fitted_entry
from .uncertainty import ParameterUncertainty, StatedBand

Savable: TypeAlias = "Entry | Fit | physics.Muscle | Characteristic"
"""What a muscle file may contain."""

WITHOUT_MODEL = Check | Reference | Ratings | ValidityRange | ParameterUncertainty | StatedBand
"""Objects of a file that are written without their class and without the values that are not
stated.
"""


def to_toml(entry: Entry) -> str:
    """Text of the library file of an entry; numbers in SI units with all digits."""
    geometry = (
        None
        if entry.geometry == getattr(entry.characteristic, "geometry", None)
        else entry.geometry
    )
    stated = stated_table(dataclasses.replace(entry, geometry=geometry))
    return tables_toml({FORMAT_KEY: FORMAT, **stated})


def stated_table(thing: Any) -> dict[str, Any]:
    """The table of an object: the keys of its fields, without those that have their default."""
    table: dict[str, Any] = {}
    for field in dataclasses.fields(thing):
        key = field.metadata.get("key", field.name)
        value = getattr(thing, field.name)
        if key and not (value == field.default and isinstance(value, type(field.default))):
            table[key] = value
    return table


def part_toml(name: str, thing: Any) -> str:
    """Text of one table of a library file, such as [friction], with the model and its
    parameters.
    """
    return tables_toml({name: model_table(thing)})


def tables_toml(tables: Mapping[str, Any]) -> str:
    """Text of tables of plain values and models."""
    import tomlkit

    return tomlkit.dumps(_plain(tables))


def scenario_toml(
    title: str,
    plant: Any,
    input_table: Mapping[str, Any],
    run: Mapping[str, Any],
    note: str = "",
    fitted: Mapping[str, Any] | None = None,
) -> str:
    """Text of a scenario that `load_scenario` reads: a plant with all parameters, the command and
    run tables.

    Each line of `note` becomes a comment at the beginning; `fitted` are the tables [observed] and
    [uncertainty] of the fit of the plant.
    """
    comments = "".join(f"# {line}\n" for line in note.splitlines())
    tables = {
        "title": title,
        "plant": model_table(plant),
        "input": input_table,
        "run": run,
        **(fitted or {}),
    }
    return comments + tables_toml(tables)


def save(entry: Savable, path: str | Path) -> Path:
    """Write a muscle, a characteristic, a fit or a library entry to a muscle file that `load`
    reads.

    The file is complete or unchanged. The fit of a law without a geometry gives a characteristic;
    for a muscle, write `Muscle(fit.model, geometry)`. Raises FileError, and ParameterError for
    anything else.
    """
    entry = entry_of(entry)
    if not isinstance(path, str | Path):
        raise FileError(f"save: {abridged(path)} is not a path; give a text or a Path.")
    return write_text(Path(path), to_toml(entry))


def write_text(path: Path, text: str) -> Path:
    """Write a text to a file, which is complete or unchanged; line ends are those of the text.
    Raises FileError.
    """
    try:
        with atomic_file(path) as unfinished:
            unfinished.write_text(text, encoding="utf-8", newline="")
    except OSError as error:
        raise FileError(
            f"{path}: cannot be written ({error.strerror}). Name a file in a writable folder."
        ) from None
    return path


def model_table(thing: Any) -> dict[str, Any]:
    """A model as the table that `build` reads; fields that are None have this default and are left
    out.
    """
    fields = {f.name: getattr(thing, f.name) for f in dataclasses.fields(thing) if f.init}
    return {
        "model": model_name(type(thing)),
        **{name: value for name, value in fields.items() if value is not None},
    }


def _plain(value: Any) -> Any:
    """Models as tables, tuples as lists, NumPy numbers as floats; in a table, values stand before
    inner tables.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _plain(
            stated_table(value) if isinstance(value, WITHOUT_MODEL) else model_table(value)
        )
    if isinstance(value, Mapping):
        plain = {key: _plain(item) for key, item in value.items()}
        return dict(sorted(plain.items(), key=lambda item: _is_table(item[1])))
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | bool | int) else float(value)


def _is_table(value: Any) -> bool:
    """Whether TOML writes a value as a table or an array of tables."""
    return isinstance(value, dict) or (
        isinstance(value, list) and any(isinstance(item, dict) for item in value)
    )


def entry_of(thing: Savable) -> Entry:
    """The entry of a muscle, a law or a fit; an entry itself. Raises ParameterError for anything
    else.
    """
    if isinstance(thing, Entry):
        return thing
    if isinstance(thing, Fit):
        return fitted_entry(thing, entry_of(thing.model), [Path(thing.recording.origin)])
    if isinstance(thing, Characteristic):
        name = type(thing).__name__
        return Entry(
            name, name, "chosen", thing, validity_range=getattr(thing, "validity_range", None)
        )
    if isinstance(
        thing, physics.Muscle
    ):  # the elements that differ from those of a muscle without any
        absent = {field.name: field.default for field in dataclasses.fields(physics.Muscle)}
        parts = {
            name: getattr(thing, name)
            for name in OPTIONAL_PARTS
            if getattr(thing, name) != absent[name]
        }
        return Entry(
            thing.name,
            f"{thing.name}: {type(thing.contractile).__name__}",
            "chosen",
            thing.contractile,
            thing.geometry,
            validity_range=thing.validity_range,
            ratings=thing.ratings,
            **parts,
        )
    remedy = ""
    if isinstance(thing, physics.Plant):
        remedy = " A plant is written with its run: airmuscle.files.save_scenario(scenario, path)."
    raise ParameterError(
        f"save: {one_line(thing)} is no muscle, characteristic, fit or entry of the"
        f" library.{remedy}"
    )
