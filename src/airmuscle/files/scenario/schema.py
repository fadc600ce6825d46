"""JSON schemas of scenario and muscle files for editors, generated from the declared tables and
models.

With a schema, an editor marks unknown keys, values of the wrong type and numbers out of bounds, and
shows unit and meaning of each parameter. Names of inputs, columns and files are not in the schema;
they are checked when the file is loaded. Within `allow_code` a class of a user stands wherever a
model does, with any parameters: the schema does not import it. JSON Schema, draft 2020-12.
"""

import dataclasses
import inspect
import math
import types
from collections.abc import Mapping, Sequence
from typing import Any

from ...core import Parameter, parameters
from ...core.annotation_parts import alternatives, item_type, origin, type_hints
from ...engine.loop import RELATIVE, Controller, Driver
from ...physics import Muscle, Orifice, Plant
from ..library import (
    PREDICTED,
    SIZES,
    StatedBand,
    is_code_allowed,
    model_class,
    model_names,
    only_class,
)
from ..library.check import CONDITIONS, Check
from ..library.entry import Entry
from ..library.fields import is_required
from ..library.file_format import FORMAT, FORMAT_KEY
from ..library.valve_entry import PATHS
from . import controller, episodes_table, initial_state, plant_uncertainty, scenario, values
from .controller import plant_fields

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
_NUMBER = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
_UNIT = r"\s*([^\s\d.,]|1/).*"
"""Pattern of the unit after a number: no comma and no further digit, except 1/s."""
_TEXT: Schema = {"type": "string"}
_CODE: Schema = {
    "description": "module:Class, code of a user",
    "pattern": r"^\w+(\.\w+)*:\w+$",
    **_TEXT,
}
_PLAIN: Mapping[Any, str] = {int: "integer", float: "number", str: "string", bool: "boolean"}
_CHOICES = {(Check, "quantity"): tuple(CONDITIONS), (StatedBand, "quantity"): PREDICTED}
"""Texts of which only some are allowed."""


def scenario_schema() -> Schema:
    """Schema of a scenario file; see docs/guides/scenario.md."""
    models = _ModelSchemas()
    tables = models.table(scenario.ScenarioTables, model_needed=None)
    tables["properties"] |= {
        "plant": _plant(models),
        "input": _input(models),
        "episodes": models.table(episodes_table.EpisodesTable, model_needed=None),
    }
    return _document("A simulation with airmuscle", tables, models)


def muscle_schema() -> Schema:
    """Schema of a muscle file, the form of all muscles and laws of the library; see
    docs/guides/muscle-file.md.
    """
    models = _ModelSchemas()
    tables = models.table(Entry, model_needed=None)
    version = {
        "description": "version of the format of muscle files; 1 if it is not stated",
        "type": "integer",
        "minimum": 1,
        "maximum": FORMAT,
    }
    tables["properties"] |= {FORMAT_KEY: version, "product": _TEXT}
    return _document("A muscle or a law in airmuscle", tables, models)


def _document(title: str, tables: Schema, models: "_ModelSchemas") -> Schema:
    return {
        "$schema": DRAFT,
        **tables,
        "title": title,
        "$defs": dict(sorted(models.definitions.items())),
    }


def _table(properties: Schema, required: Sequence[str] = ()) -> Schema:
    required_keys = {"required": list(required)} if required else {}
    return {
        "type": "object",
        "properties": properties,
        **required_keys,
        "additionalProperties": False,
    }


def _code_table(properties: Schema, required: Sequence[str] = ()) -> Schema:
    """A table of a user's class, whose parameters the schema does not know."""
    return {
        "type": "object",
        "properties": {"model": _CODE, **properties},
        "required": ["model", *required],
    }


def _list_of(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _by_name(items: Schema) -> Schema:
    return {"type": "object", "additionalProperties": items}


def _quantity(unit: str, low: float = -math.inf, high: float = math.inf) -> Schema:
    """A number in SI units or a text with a unit; the unit is optional for a ratio, and arbitrary
    for unit "".
    """
    bounds = {
        key: value for key, value in (("minimum", low), ("maximum", high)) if math.isfinite(value)
    }
    pattern = f"{_NUMBER}({_UNIT})?$" if unit in ("1", "") else f"{_NUMBER}{_UNIT}$"
    return {"anyOf": [{"type": "number", **bounds}, {"type": "string", "pattern": pattern}]}


class _ModelSchemas:
    """Definitions of the models that a schema refers to, collected while the schema is built."""

    def __init__(self) -> None:
        self.definitions: Schema = {}

    def kind(self, cls: Any) -> Schema:
        """Any model of a class: a table that names it, or its name alone if it needs no
        parameters.
        """
        if only_class(cls) is not None:
            return self._reference(cls)
        name = f"Any{cls.__name__}"
        if name not in self.definitions:
            self.definitions[
                name
            ] = {}  # placeholder, because its members may contain the same kind
            members = [model_class(n, "schema") for n in model_names(cls)]
            alone = [member.__name__ for member in members if not _required_keys(member)]
            tables = [self._reference(member) for member in members]
            if cls is Orifice:
                tables.append(
                    _table({"library": _TEXT, "path": {"enum": list(PATHS)}}, ("library",))
                )
            ours = [_CODE, _code_table({})] if is_code_allowed() else []
            self.definitions[name] = {
                "anyOf": [*([{"enum": alone}] if alone else []), *tables, *ours]
            }
        return {"$ref": f"#/$defs/{name}"}

    def _reference(self, cls: type[Any]) -> Schema:
        name = cls.__name__
        if name not in self.definitions:
            self.definitions[name] = {}
            self.definitions[name] = self.table(cls, model_needed=only_class(cls) is None)
        return {"$ref": f"#/$defs/{name}"}

    def table(self, cls: type[Any], *, model_needed: bool | None = True) -> Schema:
        """Table of one class; the key `model` is required (True), optional (False) or not allowed
        (None).
        """
        is_model = hasattr(cls, "from_file") and model_needed is not None
        properties: Schema = {"model": {"const": cls.__name__}} if is_model else {}
        declared = {p.name: p for p in parameters(cls)}
        hints = type_hints(cls)
        for field in dataclasses.fields(cls):
            if field.init and (key := field.metadata.get("key", field.name)):
                if field.name in declared:
                    properties[key] = self.number(declared[field.name], hints[field.name])
                elif "read" in field.metadata:
                    read = self._read(field.metadata["read"])
                    meaning = field.metadata["meaning"]
                    properties[key] = {"description": meaning, **read}
                elif (cls, field.name) in _CHOICES:
                    properties[key] = {"enum": list(_CHOICES[cls, field.name])}
                else:
                    properties[key] = self.part(hints[field.name])
        required = [*(["model"] if is_model and model_needed else []), *_required_keys(cls)]
        summary = " ".join(inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[0].split())
        return {
            "description": summary,
            **_table(properties, [n for n in required if n not in plant_fields(cls)]),
        }

    def number(self, declared: Parameter, hint: Any) -> Schema:
        """A declared parameter."""
        written_unit = "" if declared.unit in RELATIVE else declared.unit
        number = _quantity(written_unit, *declared.bounds)
        if any(origin(option) is tuple for option in alternatives(hint)):
            column = _table({"file": _TEXT, "column": _TEXT}, ("file", "column"))
            number = {"anyOf": [_list_of(number), column]}
        unit = "" if declared.unit == "1" else f" [{declared.unit}]"
        schema = {"description": f"{declared.symbol}{unit}: {declared.meaning}", **number}
        if isinstance(declared.default, float | int):
            schema["default"] = declared.default
        return schema

    def _read(self, reader: Any) -> Schema:
        """What a reader of a field takes."""
        if isinstance(reader, values.Number):
            return _quantity(reader.unit, 0.0 if reader.positive else -math.inf)
        if isinstance(reader, values.BySignal):
            number = _quantity("", 0.0 if reader.positive else -math.inf)
            return _by_name(_list_of(number) if reader.pairs else number)
        if reader is values.read_observed:
            deviation = _quantity("", 0.0)
            return _by_name(
                {
                    "anyOf": [
                        deviation,
                        _table({"deviation": deviation, "column": _TEXT}, ("deviation",)),
                    ]
                }
            )
        if reader is plant_uncertainty.read_plant_uncertainty:
            return self._reference(plant_uncertainty.UncertaintyTable)
        if reader is episodes_table.read_record_mapping:
            return {"type": "object"}
        if reader is initial_state.read_initial_table:
            return _by_name(_quantity("m"))
        if reader is values.read_drivers:
            driver = {"anyOf": [self.kind(Driver), _table({"library": _TEXT}, ("library",))]}
            return _by_name({"anyOf": [*driver["anyOf"], _list_of(driver)]})
        return _by_name(_TEXT)

    def muscle(self) -> Schema:
        """A muscle: the name of a library entry or of a file, or a table, which may be based on
        one.
        """
        muscle = self.table(Muscle, model_needed=False)
        name = {"description": "a library entry, or a muscle file relative to this file", **_TEXT}
        required = muscle.pop("required")
        muscle["properties"] |= {"library": name, **{size: _quantity("m", 0.0) for size in SIZES}}
        return {
            "anyOf": [
                name,
                {**muscle, "anyOf": [{"required": ["library"]}, {"required": required}]},
            ]
        }

    def part(self, hint: Any) -> Schema:
        """A structural field, by its annotation."""
        if hint is Muscle:
            return self.muscle()
        if len(alternatives(hint)) > 1:
            parts = [
                self.part(option) for option in alternatives(hint) if option is not types.NoneType
            ]
            return parts[0] if len(parts) == 1 else {"anyOf": parts}
        if origin(hint) is tuple:
            return _list_of(self.part(item_type(hint)))
        return {"type": _PLAIN[hint]} if hint in _PLAIN else self.kind(hint)


def _required_keys(cls: type[Any]) -> list[str]:
    required = (f.metadata.get("key", f.name) for f in dataclasses.fields(cls) if is_required(f))
    return [key for key in required if key]


def _plant(models: _ModelSchemas) -> Schema:
    """Table of a plant; a muscle may also be the name of a library entry, or a table based on
    one.
    """
    plant = models.table(Plant, model_needed=False)
    muscle = models.muscle()
    needed = plant.pop("required")
    plant["properties"]["library"] = {
        "description": "a plant of the library, whose parts are replaced",
        **_TEXT,
    }
    plant["anyOf"] = [{"required": ["library"]}, {"required": needed}]
    plant["properties"]["muscle"] = {"anyOf": [*muscle["anyOf"], _list_of(muscle)]}
    return plant


def _input(models: _ModelSchemas) -> Schema:
    """Table of input signals; keys that are not reserved are inputs with their rows."""
    point = {
        "type": "array",
        "prefixItems": [_quantity("s"), _quantity("")],
        "minItems": 2,
        "maxItems": 2,
    }
    reserved = models.table(values.SignalTable)["properties"]
    reserved["model"] = {"enum": ["Schedule", "SampledSignal"]}
    signal = {
        "type": "object",
        "properties": {key: value for key, value in reserved.items() if key != "drivers"},
        "additionalProperties": {"description": "instants [s] and values", **_list_of(point)},
    }
    return {**signal, "properties": {**reserved, "controller": _controller(models, signal)}}


def _controller(models: _ModelSchemas, setpoint: Schema) -> Schema:
    """A controller with its parameters, sample time and set point."""
    keys = {**models.table(controller.LoopTable)["properties"], "setpoint": setpoint}
    tables = [models.table(model_class(name, "schema")) for name in model_names(Controller)]
    for table in tables:
        table["properties"] |= keys
        table["required"] += controller.LOOP_KEYS
    return {
        "anyOf": [
            *tables,
            *([_code_table(keys, controller.LOOP_KEYS)] if is_code_allowed() else []),
        ]
    }
