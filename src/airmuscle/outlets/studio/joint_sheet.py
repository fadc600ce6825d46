"""Sheet of a joint: a plant of two muscles with its control laws, tasks and reachable region, for the tab Joint."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ...core.tree import leaves
from ...design.control_benchmark import STANDARD_TASKS, ControlTask
from ...engine.compile.program import compile_system
from ...files.library.files import list_plants
from ...files.library.plant_file import plant_tables
from ...files.scenario.scenario import TABLES, build_scenario
from .joint_laws import JointController, joint_controllers, statics_within_valves, valve_set
from .joint_program import PAIR, inputs_program, law_program, linear_program, pair_program
from .plant_sheet import sheet_of_tables

DURATION = 1.0
"""Duration of the printed run [s], which the tab does not use."""
REGION_ANGLES = 61
"""Angles of the limits of the reachable region (chosen)."""


def joint_names() -> tuple[str, ...]:
    """Names of the joints of the library: plants of two muscles on one pulley."""
    return tuple(name for name in list_plants() if name.startswith("joint-"))


def sheet_of_joint(name: str) -> dict[str, Any]:
    """The sheet of a joint of the library, by its complete name. Raises the errors of its loaders."""
    tables, location = plant_tables(name)
    given = joint_tables(tables)
    sheet = sheet_of_tables(given, location, name, tables.get("sources", {}))
    plant = build_scenario(given, location).plant
    statics = statics_within_valves(plant)
    controllers = joint_controllers(plant, statics)
    measured = tuple(dict.fromkeys(column for each in controllers for column in each.law.measured_columns))
    programs = _programs(plant, controllers, measured)
    script = _extended(sheet.pop("script"), programs)
    old = sheet.pop("id")
    sheet |= {
        "tab": "joint",
        **{key: str(tables.get(key, "")) for key in ("provenance", "note", "warning")},
        "parameters": [{**row, "path": row["path"].replace(".inner.", ".")} for row in sheet["parameters"]],
        "measured": list(measured),
        "pressure_range": list(statics.pressure_range),
        "controllers": [_controller_row(each) for each in controllers],
        "region": reachable_region(statics),
        "pair": list(PAIR),
        "offsets": valve_set(plant).offsets,
        "regulated": valve_set(plant).inner is None,
        "switching": valve_set(plant).switching,
        "tasks": [_task_row(task) for task in STANDARD_TASKS if task.stuck is None],
    }
    sheet["id"] = hashlib.sha256((script + json.dumps(sheet)).encode()).hexdigest()[:32]
    return {**sheet, "script": script.replace(old, sheet["id"])}


def joint_tables(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a scenario of a joint on which an external torque acts, without the input of its example."""
    plant, run = dict(tables["plant"]), tables["run"]
    plant["mechanism"] = {"model": "JointWithExternalTorque", "inner": plant["mechanism"]}
    kept = {key: tables[key] for key in TABLES if key in tables and key not in ("plant", "input", "run")}
    return {**kept, "plant": plant, "input": {}, "run": {"duration": DURATION, "initial_state": run["initial_state"]}}


def reachable_region(statics: am.physics.JointStatics) -> dict[str, list[float]]:
    """Minimum and maximum stiffness [N m/rad] at angles [rad] without a load, where both muscles are taut."""
    angles = np.linspace(*statics.angle_range, REGION_ANGLES)
    least, greatest = statics.stiffness_limits(angles)
    inside = np.isfinite(least) & np.isfinite(greatest)
    return {key: values[inside].tolist() for key, values in
            (("angle", angles), ("least", least), ("greatest", greatest))}  # fmt: skip


def _programs(plant: am.Plant, controllers: tuple[JointController, ...], measured: tuple[str, ...]) -> dict[str, str]:
    """The programs of the tab as expressions of JavaScript, by name."""
    compiled = compile_system(plant)
    states = compiled.description.state_names
    programs = {
        "linear": linear_program(compiled.program.traced, states, measured), "statics": pair_program(plant),
        "inputs": inputs_program(),
    }  # fmt: skip
    for each in controllers:
        same = each.law is each.averaged
        programs[each.key] = law_program(each.law, sample=True, slopes=same)
        if not same:
            programs[f"{each.key}-averaged"] = law_program(each.averaged, sample=False, slopes=True)
    return programs


def _extended(script: str, programs: Mapping[str, str]) -> str:
    """The script of a plant with further programs in its entry of the table."""
    rows = ",\n".join(f"{json.dumps(name)}: {text}" for name, text in programs.items())
    head = script.partition(" = ")[0].splitlines()[-1]
    return f"{script}{head}.joint = {{\n{rows}\n}};\n"


def _controller_row(controller: JointController) -> dict[str, Any]:
    law, averaged = controller.law, controller.averaged
    known, inner = list(leaves(law)), list(leaves(averaged))
    prefix = "law." if _is_modulated(law) else ""
    return {
        "key": controller.key,
        "setpoints": list(law.setpoints),
        "measured": list(law.measured_columns),
        "inputs": list(law.inputs),
        "memory": list(law.initial_memory),
        "initial_memory": [float(value) for value in law.initial_memory.values()],
        "paths": [leaf.path for leaf in known],
        "values": [float(leaf.value) for leaf in known],
        "prefix": prefix,
        "averaged_paths": [leaf.path for leaf in inner],
        "averaged_memory": list(averaged.initial_memory),
        "averaged_start": [float(value) for value in averaged.initial_memory.values()],
        "balance": controller.balance,
        "bias": f"{prefix}{controller.bias}" if controller.bias else "",
        "gains": [{**dataclasses.asdict(gain), "path": f"{prefix}{gain.path}", "bounds": _bounds(averaged, gain.path)}
                  for gain in controller.gains],
    }  # fmt: skip


def _is_modulated(law: Any) -> bool:
    return hasattr(law, "law")


def _bounds(law: Any, path: str) -> list[float | None]:
    """The bounds of a parameter; None where there is none."""
    low, high = next(leaf.declared.bounds for leaf in leaves(law) if leaf.path == path)
    return [float(bound) if np.isfinite(bound) else None for bound in (low, high)]


def _task_row(task: ControlTask) -> dict[str, Any]:
    """A task of the control benchmark as plain data."""
    return {
        "name": task.name,
        "motion": {"kind": type(task.motion).__name__, **dataclasses.asdict(task.motion)},
        "duration": task.duration,
        "begin": task.begin,
        "torque": [list(point) for point in task.torque],
        "stiffening": [list(point) for point in task.stiffening],
    }
