"""JSON schemas of the files that people write, for editors: generated from the declared models, never kept by hand.

A schema finds keys that are not known, values of the wrong type and numbers beyond their bounds while one types, and
shows unit and meaning of each. What only a run can know, names of inputs, columns and files, the program says itself.
JSON Schema, draft 2020-12.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any

from ..control.controller import RELATIVE, Controller
from ..control.driver import Driver
from ..core.declaration import Parameter, parameters
from ..core.reference import Reference
from ..library import read
from ..library.models import model_class, model_names
from ..library.valve_catalogue import PATHS
from ..muscle import Muscle
from ..plant.plant import Plant
from ..pneumatics.orifice import Orifice
from ..simulation.integrators import Integrator
from . import controller, inputs, scenario

Schema = dict[str, Any]
DRAFT = "https://json-schema.org/draft/2020-12/schema"
_NUMBER = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
_UNIT = r"\s*([^\s\d.,]|1/).*"
"""What may follow a number: no comma, no further digit, but 1/s."""
_TEXT: Schema = {"type": "string"}
_PLAIN: Mapping[Any, str] = {int: "integer", float: "number", str: "string", bool: "boolean"}


def scenario_schema() -> Schema:
    """The schema of a scenario file; see docs/scenario.md."""
    known = _ModelSchemas()
    tables = {
        "title": _TEXT,
        "plant": _plant(known),
        "command": _command(known),
        "run": _run(known),
        "output": _table({"columns": {"type": "array", "items": _TEXT}}),
    }
    return _document("A simulation with airmuscle", _select_keys(tables, scenario.TABLES), ("plant", "run"), known)


def muscle_schema() -> Schema:
    """The schema of a muscle file and of every file of the library; see docs/muscle-file.md."""
    known = _ModelSchemas()
    quantities = {name: _quantity(unit) for name, unit in read.QUANTITIES.items()}
    check = {
        "quantity": {"enum": list(quantities)},
        "source": _TEXT,
        "equals": _quantity(""),
        "tolerance": _quantity(""),
        **quantities,
    }
    tables = {
        **dict.fromkeys(read._TEXTS, _TEXT),
        **{key: known.kind(cls) for key, cls in read._PARTS.items()},
        "validity_range": known.table(model_class("ValidityRange", "schema"), model_needed=False),
        "check": {"type": "array", "items": _table(check, ("quantity", "equals", "tolerance", "source"))},
        "reference": {"type": "array", "items": known.table(Reference, model_needed=None)},
    }
    return _document(
        "A muscle or a law in airmuscle",
        _select_keys(tables, read._KEYS),
        ("title", "provenance", "characteristic"),
        known,
    )


def _document(title: str, properties: Schema, required: Sequence[str], known: _ModelSchemas) -> Schema:
    return {
        "$schema": DRAFT,
        "title": title,
        **_table(properties, required),
        "$defs": dict(sorted(known.found.items())),
    }


def _select_keys(tables: Schema, keys: Sequence[str]) -> Schema:
    """The tables in the order of the keys that the reader of the file takes; KeyError where one is not described."""
    return {key: tables[key] for key in keys}


def _table(properties: Schema, required: Sequence[str] = ()) -> Schema:
    needed = {"required": list(required)} if required else {}
    return {"type": "object", "properties": properties, **needed, "additionalProperties": False}


def _quantity(unit: str, low: float = -math.inf, high: float = math.inf) -> Schema:
    """A number in SI, or text with its unit; a ratio needs none, and with the unit "" anything goes."""
    bounds = {key: value for key, value in (("minimum", low), ("maximum", high)) if math.isfinite(value)}
    pattern = f"{_NUMBER}({_UNIT})?$" if unit in ("1", "") else f"{_NUMBER}{_UNIT}$"
    return {"anyOf": [{"type": "number", **bounds}, {"type": "string", "pattern": pattern}]}


class _ModelSchemas:
    """The definitions of the models that a schema refers to, found while it is made."""

    def __init__(self) -> None:
        self.found: Schema = {}

    def kind(self, cls: type[Any]) -> Schema:
        """Any model of a class: a table that names it, or, where it needs no parameters, its name alone."""
        name = f"Any{cls.__name__}"
        if name not in self.found:
            self.found[name] = {}  # stands while its members are made, which may contain their own kind
            members = [n for n in model_names() if issubclass(model_class(n, "schema"), cls)]
            alone = [n for n in members if not _required_fields(model_class(n, "schema"))]
            tables = [self._reference(n) for n in members]
            if cls is Orifice:
                tables.append(_table({"library": _TEXT, "path": {"enum": list(PATHS)}}, ("library",)))
            self.found[name] = {"anyOf": [*([{"enum": alone}] if alone else []), *tables]}
        return {"$ref": f"#/$defs/{name}"}

    def _reference(self, name: str) -> Schema:
        if name not in self.found:
            self.found[name] = {}
            self.found[name] = self.table(model_class(name, "schema"))
        return {"$ref": f"#/$defs/{name}"}

    def table(self, cls: type[Any], *, model_needed: bool | None = True) -> Schema:
        """The table of one model. It names the model, may name it, or (None) must not, being of one kind only."""
        properties: Schema = {} if model_needed is None else {"model": {"const": cls.__name__}}
        declared = {p.name: p for p in parameters(cls)}
        hints = typing.get_type_hints(cls)
        for field in dataclasses.fields(cls):
            if field.init:
                properties[field.name] = self.field(declared.get(field.name), hints[field.name])
        required = [*(["model"] if model_needed else []), *_required_fields(cls)]
        summary = " ".join(inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[0].split())
        return {"description": summary, **_table(properties, required)}

    def field(self, declared: Parameter | None, hint: Any) -> Schema:
        """One parameter, with its meaning, unit and bounds, or one part of a model."""
        if declared is None:
            return self.part(hint)
        number = _quantity("" if declared.unit in RELATIVE else declared.unit, *declared.bounds)
        if typing.get_origin(hint) is tuple:
            column = _table({"file": _TEXT, "column": _TEXT}, ("file", "column"))
            number = {"anyOf": [{"type": "array", "items": number}, column]}
        unit = "" if declared.unit == "1" else f" [{declared.unit}]"
        default = {"default": declared.default} if isinstance(declared.default, float | int) else {}
        return {"description": f"{declared.symbol}{unit}: {declared.meaning}", **number, **default}

    def part(self, hint: Any) -> Schema:
        """What a field that is no declared number may hold, by its annotation."""
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


def _plant(known: _ModelSchemas) -> Schema:
    """A plant is the table of its fields, but its muscles may also be named, or begin from a library entry."""
    plant, muscle = (known.table(cls, model_needed=False) for cls in (Plant, Muscle))
    name = {"description": "a library entry, or a muscle file beside this one", **_TEXT}
    given = muscle.pop("required")
    muscle["properties"]["library"] = name
    own = {**muscle, "anyOf": [{"required": ["library"]}, {"required": given}]}
    each = {"anyOf": [name, own]}
    plant["properties"]["muscle"] = {"anyOf": [*each["anyOf"], {"type": "array", "items": each}]}
    return plant


def _command(known: _ModelSchemas) -> Schema:
    point = {"type": "array", "prefixItems": [_quantity("s"), _quantity("")], "minItems": 2, "maxItems": 2}
    rows = {"description": "instants [s] and values", "type": "array", "items": point}
    driver = known.kind(Driver)
    each = {"anyOf": [driver, _table({"library": _TEXT}, ("library",))]}
    chain = {"anyOf": [*each["anyOf"], {"type": "array", "items": each}]}
    keys = {
        "model": {"enum": ["Schedule", "SampledSignal"]},
        "period": _quantity("s"),
        "file": _TEXT,
        "columns": {"type": "object", "additionalProperties": _TEXT},
        "drivers": {"type": "object", "additionalProperties": chain},
    }
    known_keys = _select_keys(keys, inputs.RESERVED_KEYS)
    plain_keys = {key: value for key, value in known_keys.items() if key != "drivers"}
    plain = {"type": "object", "properties": plain_keys, "additionalProperties": rows}
    return {**plain, "properties": {**known_keys, "controller": _controller(known, plain)}}


def _controller(known: _ModelSchemas, setpoint: Schema) -> Schema:
    """A controller with its parameters, and beside them how often it looks and what it is to follow."""
    keys = {"period": _quantity("s", low=0.0), "setpoint": setpoint}
    tables = []
    for name in model_names():
        cls = model_class(name, "schema")
        if issubclass(cls, Controller):
            table = known.table(cls)
            table["properties"] |= _select_keys(keys, controller.LOOP_KEYS)
            tables.append({**table, "required": [*table["required"], *controller.LOOP_KEYS]})
    return {"anyOf": tables}


def _run(known: _ModelSchemas) -> Schema:
    keys = {
        "duration": _quantity("s", low=0.0),
        "start_time": _quantity("s"),
        "output": _quantity("s", low=0.0),
        "start": {"type": "object", "additionalProperties": _quantity("m")},
        "method": known.kind(Integrator),
    }
    return _table(_select_keys(keys, scenario.RUN), ("duration",))
