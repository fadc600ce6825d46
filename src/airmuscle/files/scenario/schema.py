"""JSON schemas of scenario and muscle files for editors, generated from the declared models.

With a schema, an editor marks unknown keys, values of the wrong type and numbers out of bounds, and shows unit and
meaning of each parameter. Names of inputs, columns and files are not in the schema; they are checked when the file is
loaded. JSON Schema, draft 2020-12.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.declaration import Parameter, parameters
from ...core.reference import Reference
from ...engine.loop.controller import RELATIVE, Controller
from ...engine.loop.driver import Driver
from ...engine.run.integrators import Integrator
from ...physics.muscle import Muscle
from ...physics.plant.plant import Plant
from ...physics.pneumatics.valve import Orifice
from ..library import entry_file, plant_file, stated_band, uncertainty
from ..library.build import TEXT_KEYS
from ..library.models import model_class, model_names
from ..library.valve_entry import PATHS
from . import controller, inputs, plant_uncertainty, scenario
from .law_table import plant_fields

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
_NUMBER = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
_UNIT = r"\s*([^\s\d.,]|1/).*"
"""Pattern of the unit after a number: no comma and no further digit, except 1/s."""
_TEXT: Schema = {"type": "string"}
_PLAIN: Mapping[Any, str] = {int: "integer", float: "number", str: "string", bool: "boolean"}


def scenario_schema() -> Schema:
    """Schema of a scenario file; see docs/scenario.md."""
    models = _ModelSchemas()
    tables = {
        "title": _TEXT,
        "plant": _plant(models),
        "input": _input(models),
        "run": _run(models),
        "output": _table({"columns": {"type": "array", "items": _TEXT}}),
        "observed": {"type": "object", "additionalProperties": _observed()},
        "uncertainty": _table(_plant_uncertainty(), (plant_uncertainty.DEVIATIONS,)),
    }
    return _document("A simulation with airmuscle", _select_keys(tables, scenario.TABLES), ("plant", "run"), models)


def muscle_schema() -> Schema:
    """Schema of a muscle file, the form of all muscles and laws of the library; see docs/muscle-file.md."""
    models = _ModelSchemas()
    quantities = {name: _quantity(unit) for name, unit in entry_file.QUANTITIES.items()}
    check = {
        "quantity": {"enum": list(quantities)},
        "source": _TEXT,
        "equals": _quantity(""),
        "tolerance": _quantity(""),
        **quantities,
    }
    tables = {
        **dict.fromkeys(TEXT_KEYS, _TEXT),
        **{key: models.kind(cls) for key, cls in entry_file.PARTS.items()},
        "product": _TEXT,
        "ratings": models.table(model_class("Ratings", "schema"), model_needed=False),
        "validity_range": models.table(model_class("ValidityRange", "schema"), model_needed=False),
        "uncertainty": _table(_uncertainty(), uncertainty.KEYS),
        "error_band": _table(_error_band(), stated_band.KEYS[:2]),
        "check": {"type": "array", "items": _table(check, ("quantity", "equals", "tolerance", "source"))},
        "reference": {"type": "array", "items": models.table(Reference, model_needed=None)},
    }
    return _document(
        "A muscle or a law in airmuscle",
        _select_keys(tables, entry_file.KEYS),
        ("title", "provenance", "characteristic"),
        models,
    )


def _uncertainty() -> Schema:
    numbers = {"type": "array", "items": {"type": "number"}}
    names = {"type": "array", "items": _TEXT}
    return {"parameters": names, "standard_errors": numbers, "correlations": {"type": "array", "items": numbers}}


def _observed() -> Schema:
    deviation = _quantity("", 0.0)
    return {"anyOf": [deviation, _table({"deviation": deviation, "column": _TEXT}, ("deviation",))]}


def _plant_uncertainty() -> Schema:
    deviations = {"type": "object", "additionalProperties": _quantity("")}
    ends = {"type": "object", "additionalProperties": _list_of(_quantity(""))}
    keys = {plant_uncertainty.DEVIATIONS: deviations, "records": {"type": "integer", "minimum": 1}}
    return {**keys, "factors": deviations, "ranges": ends, "rates": deviations, **_uncertainty()}


def _error_band() -> Schema:
    numbers = {**dict.fromkeys(stated_band.WIDTHS, _quantity("", 0.0))}
    numbers |= {key: _quantity(unit, 0.0) for key, unit in stated_band.RATES.items()}
    texts = dict.fromkeys(("source", "new_specimen_source"), _TEXT)
    lists = {"specimens": _list_of(_TEXT), "resting_lengths": _list_of(_quantity("m", 0.0))}
    return {"quantity": {"enum": list(stated_band.PREDICTED)}, **numbers, **texts, **lists}


def _list_of(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _document(title: str, properties: Schema, required: Sequence[str], models: _ModelSchemas) -> Schema:
    return {
        "$schema": DRAFT,
        "title": title,
        **_table(properties, required),
        "$defs": dict(sorted(models.definitions.items())),
    }


def _select_keys(tables: Schema, keys: Sequence[str]) -> Schema:
    """The schemas of the keys that the loader of the file accepts, in their order; KeyError if one is missing."""
    return {key: tables[key] for key in keys}


def _table(properties: Schema, required: Sequence[str] = ()) -> Schema:
    required_keys = {"required": list(required)} if required else {}
    return {"type": "object", "properties": properties, **required_keys, "additionalProperties": False}


def _quantity(unit: str, low: float = -math.inf, high: float = math.inf) -> Schema:
    """A number in SI units or a text with a unit; the unit is optional for a ratio, and arbitrary for unit ""."""
    bounds = {key: value for key, value in (("minimum", low), ("maximum", high)) if math.isfinite(value)}
    pattern = f"{_NUMBER}({_UNIT})?$" if unit in ("1", "") else f"{_NUMBER}{_UNIT}$"
    return {"anyOf": [{"type": "number", **bounds}, {"type": "string", "pattern": pattern}]}


class _ModelSchemas:
    """Definitions of the models that a schema refers to, collected while the schema is built."""

    def __init__(self) -> None:
        self.definitions: Schema = {}

    def kind(self, cls: type[Any]) -> Schema:
        """Any model of a class: a table that names it, or its name alone if it needs no parameters."""
        name = f"Any{cls.__name__}"
        if name not in self.definitions:
            self.definitions[name] = {}  # placeholder, because its members may contain the same kind
            members = [n for n in model_names() if issubclass(model_class(n, "schema"), cls)]
            alone = [n for n in members if not _required_fields(model_class(n, "schema"))]
            tables = [self._reference(n) for n in members]
            if cls is Orifice:
                tables.append(_table({"library": _TEXT, "path": {"enum": list(PATHS)}}, ("library",)))
            self.definitions[name] = {"anyOf": [*([{"enum": alone}] if alone else []), *tables]}
        return {"$ref": f"#/$defs/{name}"}

    def _reference(self, name: str) -> Schema:
        if name not in self.definitions:
            self.definitions[name] = {}
            self.definitions[name] = self.table(model_class(name, "schema"))
        return {"$ref": f"#/$defs/{name}"}

    def table(self, cls: type[Any], *, model_needed: bool | None = True) -> Schema:
        """Table of one model; the key `model` is required (True), optional (False) or not allowed (None)."""
        properties: Schema = {} if model_needed is None else {"model": {"const": cls.__name__}}
        declared = {p.name: p for p in parameters(cls)}
        hints = typing.get_type_hints(cls)
        for field in dataclasses.fields(cls):
            if field.init:
                properties[field.name] = self.field(declared.get(field.name), hints[field.name])
        of_plant = plant_fields(cls)
        required = [*(["model"] if model_needed else []), *(n for n in _required_fields(cls) if n not in of_plant)]
        summary = " ".join(inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[0].split())
        return {"description": summary, **_table(properties, required)}

    def field(self, declared: Parameter | None, hint: Any) -> Schema:
        """A parameter with meaning, unit and bounds, or a structural field."""
        if declared is None:
            return self.part(hint)
        number = _quantity("" if declared.unit in RELATIVE else declared.unit, *declared.bounds)
        if typing.get_origin(hint) is tuple:
            column = _table({"file": _TEXT, "column": _TEXT}, ("file", "column"))
            number = {"anyOf": [{"type": "array", "items": number}, column]}
        unit = "" if declared.unit == "1" else f" [{declared.unit}]"
        default = {"default": declared.default} if isinstance(declared.default, float | int) else {}
        return {"description": f"{declared.symbol}{unit}: {declared.meaning}", **number, **default}

    def muscle(self) -> Schema:
        """A muscle: the name of a library entry or of a file, or a table, which may be based on one."""
        muscle = self.table(Muscle, model_needed=False)
        name = {"description": "a library entry, or a muscle file relative to this file", **_TEXT}
        required = muscle.pop("required")
        muscle["properties"] |= {"library": name, **{size: _quantity("m", 0.0) for size in plant_file.SIZES}}
        return {"anyOf": [name, {**muscle, "anyOf": [{"required": ["library"]}, {"required": required}]}]}

    def part(self, hint: Any) -> Schema:
        """A structural field, by its annotation."""
        if hint is Muscle:
            return self.muscle()
        if typing.get_origin(hint) in (typing.Union, types.UnionType):
            options = [self.part(option) for option in typing.get_args(hint) if option is not types.NoneType]
            return options[0] if len(options) == 1 else {"anyOf": options}
        if typing.get_origin(hint) is tuple:
            return {"type": "array", "items": self.part(typing.get_args(hint)[0])}
        return {"type": _PLAIN[hint]} if hint in _PLAIN else self.kind(hint)


def _required_fields(cls: type[Any]) -> list[str]:
    return [
        field.name
        for field in dataclasses.fields(cls)
        if field.init and field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    ]


def _plant(models: _ModelSchemas) -> Schema:
    """Table of a plant; a muscle may also be the name of a library entry, or a table based on one."""
    plant, each = models.table(Plant, model_needed=False), models.muscle()
    needed = plant.pop("required")
    plant["properties"]["library"] = {"description": "a plant of the library, whose parts are replaced", **_TEXT}
    plant["anyOf"] = [{"required": ["library"]}, {"required": needed}]
    plant["properties"]["muscle"] = {"anyOf": [*each["anyOf"], {"type": "array", "items": each}]}
    return plant


def _input(models: _ModelSchemas) -> Schema:
    point = {"type": "array", "prefixItems": [_quantity("s"), _quantity("")], "minItems": 2, "maxItems": 2}
    rows = {"description": "instants [s] and values", "type": "array", "items": point}
    driver = models.kind(Driver)
    each = {"anyOf": [driver, _table({"library": _TEXT}, ("library",))]}
    chain = {"anyOf": [*each["anyOf"], {"type": "array", "items": each}]}
    keys = {
        "model": {"enum": ["Schedule", "SampledSignal"]},
        "period": _quantity("s"),
        "file": _TEXT,
        "columns": {"type": "object", "additionalProperties": _TEXT},
        "drivers": {"type": "object", "additionalProperties": chain},
    }
    reserved = _select_keys(keys, inputs.RESERVED_KEYS)
    signal_keys = {key: value for key, value in reserved.items() if key != "drivers"}
    signal = {"type": "object", "properties": signal_keys, "additionalProperties": rows}
    return {**signal, "properties": {**reserved, "controller": _controller(models, signal)}}


def _controller(models: _ModelSchemas, setpoint: Schema) -> Schema:
    """A controller with its parameters, sample time and set point."""
    keys = {"sample_time": _quantity("s", low=0.0), "setpoint": setpoint}
    tables = []
    for name in model_names():
        cls = model_class(name, "schema")
        if issubclass(cls, Controller):
            table = models.table(cls)
            table["properties"] |= _select_keys(keys, controller.LOOP_KEYS)
            tables.append({**table, "required": [*table["required"], *controller.LOOP_KEYS]})
    return {"anyOf": tables}


def _run(models: _ModelSchemas) -> Schema:
    keys = {
        "duration": _quantity("s", low=0.0),
        "start_time": _quantity("s"),
        "output_times": _quantity("s", low=0.0),
        "initial_state": {"type": "object", "additionalProperties": _quantity("m")},
        "integrator": models.kind(Integrator),
    }
    return _table(_select_keys(keys, scenario.RUN), ("duration",))
