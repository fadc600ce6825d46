"""The schemas are the program's own models: what the files of docs, examples and library hold
passes, what is broken does not, and nothing that a schema refuses is read by the program.

A validator of the few keywords that the schemas use stands in this file; jsonschema judges too,
where it is installed.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from command_line import airmuscle

from airmuscle.core import parameters
from airmuscle.errors import AirmuscleError
from airmuscle.files import (
    allow_code,
    list_laws,
    list_plants,
    load,
    load_scenario,
    muscle_schema,
    scenario_schema,
    to_toml,
)
from airmuscle.files.library import PLANTS, Location, build_entry, model_class
from airmuscle.files.scenario import TABLES

ROOT = Path(__file__).parents[2]
LIBRARY = sorted((ROOT / "src" / "airmuscle" / "files" / "library").glob("*.toml"))
EXAMPLES = [
    p
    for p in sorted((ROOT / "examples").glob("*.toml"))
    if "[vary]" not in p.read_text(encoding="utf-8")
    and not p.stem.startswith(("cluster", "air_leg"))
]
"""The scenarios; studies, clusters and moves of routes have other tables."""
"""Scenarios; a study of many runs has a grammar of its own."""
SCENARIO = scenario_schema()
MUSCLE = muscle_schema()
ABOUT = {"$schema", "$defs", "title", "description", "default"}
TYPES = {
    "object": dict,
    "array": list,
    "string": str,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
}


def blocks(page: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL)


def is_type(value: Any, kind: str) -> bool:
    return isinstance(value, TYPES[kind]) and (kind == "boolean" or not isinstance(value, bool))


def faults(value: Any, schema: dict[str, Any], root: dict[str, Any], where: str = "") -> list[str]:
    """What a value has against a schema. A keyword that is not judged here is an error of the
    test.
    """
    found: list[str] = []
    for keyword, given in schema.items():
        match keyword:
            case "$ref":
                found += faults(value, root["$defs"][given.removeprefix("#/$defs/")], root, where)
            case "anyOf":
                found += (
                    [f"{where}: none of {len(given)}"]
                    if all(faults(value, s, root) for s in given)
                    else []
                )
            case "type":
                found += [] if is_type(value, given) else [f"{where}: no {given}"]
            case "enum":
                found += [] if value in given else [f"{where}: none of {given}"]
            case "const":
                found += [] if value == given else [f"{where}: not {given}"]
            case "minimum" | "maximum" if is_type(value, "number"):
                found += (
                    []
                    if (value >= given if keyword == "minimum" else value <= given)
                    else [f"{where}: {keyword}"]
                )
            case "pattern" if isinstance(value, str):
                found += [] if re.search(given, value) else [f"{where}: no number with a unit"]
            case _ if keyword in OF_LISTS and isinstance(value, list):
                found += faults_of_list(value, keyword, given, root, where)
            case _ if keyword in OF_TABLES and isinstance(value, dict):
                found += faults_of_table(value, keyword, schema, root, where)
            case _ if keyword in ABOUT or keyword in JUDGED:
                continue
            case _:
                raise AssertionError(f"the test does not judge '{keyword}'")
    return found


def faults_of_list(
    value: list[Any], keyword: str, given: Any, root: dict[str, Any], where: str
) -> list[str]:
    """What a list has against a keyword of lists."""
    if keyword in ("minItems", "maxItems"):
        allowed = len(value) >= given if keyword == "minItems" else len(value) <= given
        return [] if allowed else [where]
    schemas = given if keyword == "prefixItems" else [given] * len(value)
    found = []
    for i, (item, schema) in enumerate(zip(value, schemas, strict=False)):
        found += faults(item, schema, root, f"{where}[{i}]")
    return found


def faults_of_table(
    value: dict[str, Any], keyword: str, schema: dict[str, Any], root: dict[str, Any], where: str
) -> list[str]:
    """What a table has against a keyword of tables."""
    given = schema[keyword]
    if keyword == "required":
        return [f"{where}: lacks {key}" for key in given if key not in value]
    known = schema.get("properties", {})
    if keyword == "additionalProperties":
        further = [key for key in value if key not in known]
        if given is False:
            return [f"{where}: {key} is not known" for key in further]
        schemas = dict.fromkeys(further, given)
    else:
        schemas = {key: known[key] for key in known if key in value}
    found = []
    for key, of_key in schemas.items():
        found += faults(value[key], of_key, root, f"{where}.{key}")
    return found


OF_LISTS = ("minItems", "maxItems", "prefixItems", "items")
OF_TABLES = ("required", "properties", "additionalProperties")
JUDGED = {
    "minimum",
    "maximum",
    "pattern",
    "minItems",
    "maxItems",
    "prefixItems",
    "items",
    "required",
    "properties",
    "additionalProperties",
}


def judged(value: Any, schema: dict[str, Any]) -> list[str]:
    """The faults, on which jsonschema, where it is installed, must agree."""
    found = faults(value, schema, schema)
    try:
        import jsonschema
    except ImportError:
        return found
    theirs = list(jsonschema.Draft202012Validator(schema).iter_errors(value))
    assert bool(theirs) == bool(found), (found, [e.message for e in theirs])
    return found


# What is right passes


@pytest.mark.parametrize("path", LIBRARY, ids=lambda p: p.stem)
def test_every_file_of_the_library_passes(path: Path):
    assert judged(tomllib.loads(path.read_text(encoding="utf-8")), MUSCLE) == []


@pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")
@pytest.mark.parametrize("name", list_laws())
def test_every_entry_passes_in_the_form_that_fit_and_save_write(name: str):
    assert judged(tomllib.loads(to_toml(load(name))), MUSCLE) == []


@pytest.mark.parametrize("text", blocks("guides/muscle-file.md"))
def test_the_muscle_of_the_page_passes(text: str):
    assert judged(tomllib.loads(text), MUSCLE) == []


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_every_example_passes(path: Path):
    assert judged(tomllib.loads(path.read_text(encoding="utf-8")), SCENARIO) == []


@pytest.mark.parametrize("name", list_plants())
def test_every_plant_of_the_library_passes(name: str):
    tables = tomllib.loads((PLANTS / f"{name}.toml").read_text(encoding="utf-8"))
    assert judged({key: tables[key] for key in TABLES if key in tables}, SCENARIO) == []


def test_a_plant_without_a_circuit_passes_only_with_a_library_plant():
    run = {"duration": "1 s"}
    assert judged({"plant": {"library": "joint-dmsp-20-matrix"}, "run": run}, SCENARIO) == []
    assert judged({"plant": {"muscle": "dmsp-20-300"}, "run": run}, SCENARIO) != []


@pytest.mark.parametrize("text", blocks("guides/scenario.md"))
def test_every_table_of_the_page_passes(text: str):
    """Pieces of a scenario lack tables; the tables that they have must pass."""
    tables = tomllib.loads(text)
    schema = {**SCENARIO, "required": []}
    part = {key: value for key, value in schema["properties"]["plant"].items() if key != "anyOf"}
    schema["properties"] = {**schema["properties"], "plant": part}
    assert judged(tables, schema) == []


# What is broken does not

GOOD = (ROOT / "examples" / "fill_discharge.toml").read_text(encoding="utf-8")
BROKEN = [
    ("duration =", "duratoin =", ".run: duratoin is not known"),
    ('duration = "25 s"', "duration = true", ".run.duration: none of"),
    ('duration = "25 s"', "duration = -3", ".run.duration: none of"),
    ('duration = "25 s"', 'duration = "25,5 s"', ".run.duration: none of"),
    ('duration = "25 s"', 'duration = "25"', ".run.duration: none of"),
    ("[run]", "[Run]", ": lacks run"),
    ("[input]", "[commands]", ": commands is not known"),
    ('"HangingMass"', '"HangingMas"', ".plant.mechanism: none of"),
    ('"HangingMass"', '"Valve"', ".plant.mechanism: none of"),
    ("mass = ", "mas = ", ".plant.mechanism: none of"),
    ('mass = "10 kg"', "mass = 1e9", ".plant.mechanism: none of"),
    ('gas = "Isothermal"', 'gas = "Isotherm"', ".plant.gas: none of"),
    ('gas = "Isothermal"', "gaz = 1", ".plant: gaz is not known"),
    ("critical_ratio = 0.433 }\ndis", "critical_ration = 0.433 }\ndis", ".plant.circuit: none of"),
    ("damping = ", "dampin = ", ".plant.muscle: none of"),
    ('library = "dmsp-20-300"\n', "", ".plant.muscle: none of"),
    ('fill = [["5 s", 1], ["15 s", 0]]', 'fill = [["5 s"], ["15 s", 0]]', ".input.fill[0]"),
    ('fill = [["5 s", 1], ["15 s", 0]]', "fill = 1", ".input.fill: no array"),
    ('fill = [["5 s", 1], ["15 s", 0]]', "fill = [[0, true]]", ".input.fill[0][1]: none of"),
    (
        "[input]",
        '[input]\nmodel = "Shedule"',
        ".input.model: none of ['Schedule', 'SampledSignal']",
    ),
    ("[input]", '[input]\ndrivers = { fill = "OnOf" }', ".input.drivers.fill: none of"),
    ("[input]", '[input]\ndrivers = { fill = { model = "PWM" } }', ".input.drivers.fill: none of"),
    ("[input]", "[input]\nfile = 3", ".input.file: no string"),
    ("[run]", "[output]\ncolumns = 3\n[run]", ".output.columns: no array"),
    ("[run]", '[run]\nintegrator = { model = "RungeKutta4" }', ".run.integrator: none of"),
    ("title =", "titel =", ": titel is not known"),
]


@pytest.mark.parametrize(("was", "becomes", "fault"), BROKEN)
def test_a_broken_scenario_is_found_by_the_schema_and_refused_by_the_program(
    tmp_path: Path, was: str, becomes: str, fault: str
):
    assert was in GOOD
    text = GOOD.replace(was, becomes, 1)
    found = judged(tomllib.loads(text), SCENARIO)
    assert any(f.startswith(fault) for f in found), found
    (tmp_path / "scenario.toml").write_text(text, encoding="utf-8")
    with pytest.raises(AirmuscleError):
        load_scenario(tmp_path / "scenario.toml")


@pytest.mark.parametrize(
    ("was", "becomes", "fault"),
    [
        ("title =", "titel =", ": lacks title"),
        ('wall_thickness = "1.8 mm"', "wall_thicknes = 1e-3", ".characteristic: none of"),
        ('wall_thickness = "1.8 mm"', "wall_thickness = [1e-3]", ".characteristic: none of"),
        ('wall_thickness = "1.8 mm"\n', "", ".characteristic: none of"),
        ('quantity = "force"', 'quantity = "stiffness"', ".check[0].quantity: none of"),
        ('equals = "328.0 N"', "", ".check[0]: lacks equals"),
        ("max_contraction", "max_contractoin", ".validity_range: max_contractoin is not known"),
    ],
)
def test_a_broken_muscle_is_found_by_the_schema_and_refused_by_the_program(
    was: str, becomes: str, fault: str
):
    (text,) = blocks("guides/muscle-file.md")
    tables = tomllib.loads(text.replace(was, becomes, 1))
    found = judged(tables, MUSCLE)
    assert any(f.startswith(fault) for f in found), found
    with pytest.raises(AirmuscleError):
        build_entry(tables, Location("broken.toml", "", ROOT))


# It is generated


def test_unit_meaning_and_bounds_are_those_of_the_declaration():
    (declared,) = [p for p in parameters(model_class("Valve", "test")) if p.name == "conductance"]
    shown = SCENARIO["$defs"]["Valve"]["properties"]["conductance"]
    assert shown["description"] == f"{declared.symbol} [{declared.unit}]: {declared.meaning}"
    assert (shown["anyOf"][0]["minimum"], shown["anyOf"][0]["maximum"]) == declared.bounds


def test_the_command_prints_or_writes_what_editors_read(tmp_path: Path):
    printed = airmuscle("schema")
    assert (printed.exit_code, json.loads(printed.stdout)) == (0, SCENARIO)
    file = tmp_path / "new" / "muscle.schema.json"
    written = airmuscle("schema", "--muscle", "--out", file)
    assert (written.exit_code, written.stdout) == (0, f"schema: {file}\n")
    assert json.loads(file.read_text(encoding="utf-8")) == MUSCLE
    assert [p.name for p in file.parent.iterdir()] == [file.name]
    (tmp_path / "file").write_text("", encoding="utf-8")
    refused = airmuscle("schema", "--out", tmp_path / "file" / "x.json")
    assert refused.exit_code == 1
    assert "cannot be written to" in refused.stderr
    nameless = airmuscle("schema", "--out", "")
    assert nameless.exit_code == 2
    assert "--out must be a file name" in nameless.stderr


@pytest.mark.parametrize(
    "name", ["my_laws:Zone", "lab.laws:Zone", "my_laws", "my laws:Zone", "PIDD"]
)
def test_a_class_of_a_user_passes_with_permission_alone(name):
    """In place of a controller, and of the law within one, with any parameters; a loop still needs
    its own keys.
    """
    with allow_code():
        permitted = scenario_schema()
    loop = tomllib.loads((ROOT / "examples" / "pressure_loop.toml").read_text(encoding="utf-8"))
    own = {"model": name, "zones": [1.0]}
    keys = {key: loop["input"]["controller"][key] for key in ("sample_time", "setpoint")}
    laws = [own | keys, {"model": "Multirate", "law": own, "every": 2} | keys]
    for law in laws:
        changed = {**loop, "input": {**loop["input"], "controller": law}}
        assert (not faults(changed, permitted, permitted)) is (
            name.count(":") == 1 and " " not in name
        )
        assert faults(changed, SCENARIO, SCENARIO)
    alone = {**loop, "input": {**loop["input"], "controller": own}}
    assert faults(alone, permitted, permitted)
