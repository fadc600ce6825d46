"""Sheet of a joint: a plant of two muscles with its control laws as printed programs, tasks and
readings.

The functions write into arrays that they are given; c is what `prepare(p, c)` made of the
parameters:

    sample(y, r, m, T, l, h, c, u, n)   measurements, set points, memory, sample time [s], ranges of
                                        the commands: commands and later memory
    slopes(y, r, m, T, l, h, c, f, D)   the same with f = (u, n), and D = df/d(y, m), row by row
    linear(x, u, c, f, A, B, C)         rates f, df/dx, df/du, and the derivatives of columns by x,
                                        row by row
    pair(x, f)                          x = (angle, p_1, p_2), f = PAIR
    cut_segments(...)                   the kernel of `driven_inputs`, with its arguments
    needed(x, f)                        x = (angle, angular speed, angular acceleration, p_1, p_2),
                                        f = torque that the muscles must give, with that of their
                                        dampers
"""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

import airmuscle as am

from ...core import Node, ParameterError, leaves, nodes
from ...core.slopes import by_row, jacobian
from ...design.control_comparison import STANDARD_TASKS
from ...engine.compile import Printer, compile_system
from ...engine.compile.kernel_text import JavaScriptKernels
from ...engine.compile.text.languages import JavaScriptLanguage
from ...engine.run.compiled_law import trace_sample
from ...files.library import list_plants, plant_tables
from ...files.scenario.scenario import TABLES, build_scenario
from ...physics.analysis.joint_torque import load_function, torque_functions
from .joint_laws import JointController, joint_controllers, statics_within_valves, valve_set
from .law_sheet import identifier_of
from .plant_sheet import sheet_of_tables

PAIR = (
    "torque",
    "stiffness",
    "torque_by_first",
    "torque_by_second",
    "stiffness_by_first",
    "stiffness_by_second",
    "tension_first",
    "tension_second",
    "shut_valves",
    "load",
    "load_slope",
)
"""Results of `pair`, in SI units: sums over both muscles, tensions, and the torque of weights and
springs.
"""
DURATION = 1.0
"""Duration of the printed run [s], which the tab does not use."""
REGION_ANGLES = 61
"""Angles of the limits of the reachable region (chosen)."""


def joint_names() -> tuple[str, ...]:
    """Names of the joints of the library: plants of two muscles on one pulley."""
    return tuple(name for name in list_plants() if name.startswith("joint-"))


def sheet_of_joint(name: str) -> dict[str, Any]:
    """The sheet of a joint of the library, by its complete name. Raises the errors of its
    loaders.
    """
    tables, location = plant_tables(name)
    scenario = joint_tables(tables)
    sheet = sheet_of_tables(scenario, location, name, tables.get("sources", {}))
    plant = build_scenario(scenario, location).plant
    statics = statics_within_valves(plant)
    controllers = joint_controllers(plant, statics)
    measured = tuple(
        dict.fromkeys(
            column for controller in controllers for column in controller.law.measured_columns
        )
    )
    rows = ",\n".join(
        f"{json.dumps(key)}: {text}"
        for key, text in _programs(plant, controllers, measured).items()
    )
    angles = np.linspace(*statics.angle_range, REGION_ANGLES)
    region = {"angle": angles} | dict(
        zip(("least", "greatest"), statics.stiffness_limits(angles), strict=True)
    )
    taut = np.isfinite(list(region.values())).all(axis=0)  # both muscles, without a load
    script = sheet.pop("script")
    old = sheet.pop("id")
    valves = valve_set(plant)
    script += f'airmusclePrograms["{old}"].joint = {{\n{rows}\n}};\n'
    sheet |= {
        "tab": "joint",
        **{key: str(tables.get(key, "")) for key in ("provenance", "note", "warning")},
        "parameters": [
            {**row, "path": row["path"].replace(".inner.", ".")} for row in sheet["parameters"]
        ],
        "measured": list(measured),
        "pressure_range": list(statics.pressure_range),
        "controllers": [_controller_row(controller) for controller in controllers],
        "region": {key: values[taut].tolist() for key, values in region.items()},
        "pair": list(PAIR),
        "offsets": valves.offsets,
        "regulated": valves.inner is None,
        "switching": valves.switching,
        "tasks": [
            {
                "name": task.name,
                "motion": {"kind": type(task.motion).__name__, **dataclasses.asdict(task.motion)},
                "duration": task.duration,
                "begin": task.begin,
                "torque": list(map(list, task.torque)),
                "stiffening": list(map(list, task.stiffening)),
            }
            for task in STANDARD_TASKS
            if task.stuck is None
        ],
    }
    sheet["id"] = identifier_of(sheet, script)
    return {**sheet, "script": script.replace(old, sheet["id"])}


def joint_tables(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a scenario of a joint on which an external torque acts, without the input of
    its example.
    """
    plant = dict(tables["plant"])
    run = tables["run"]
    plant["mechanism"] = {"model": "JointWithExternalTorque", "inner": plant["mechanism"]}
    retained = {
        key: tables[key] for key in TABLES if key in tables and key not in ("plant", "input", "run")
    }
    return {
        **retained,
        "plant": plant,
        "input": {},
        "run": {"duration": DURATION, "initial_state": run["initial_state"]},
    }


def _programs(
    plant: am.Plant, controllers: tuple[JointController, ...], measured: tuple[str, ...]
) -> dict[str, str]:
    """The programs of the tab as expressions of JavaScript, by name; `inputs` is the kernel that
    cuts the inputs which no controller commands into the segments of a sample."""
    inputs = JavaScriptKernels().text("driven_inputs", ["cut_segments"])
    programs = {
        "linear": _linear_program(plant, measured),
        "statics": _pair_program(plant),
        "inputs": f"(() => {{\n{inputs}\nreturn {{ cut_segments }};\n}})()",
    }
    for controller in controllers:
        same = controller.law is controller.averaged
        programs[controller.key] = _law_program(controller.law, sample=True, slopes=same)
        if not same:
            programs[f"{controller.key}-averaged"] = _law_program(
                controller.averaged, sample=False, slopes=True
            )
    return programs


def _controller_row(controller: JointController) -> dict[str, Any]:
    law = controller.law
    averaged = controller.averaged
    known = list(leaves(law))
    inner = list(leaves(averaged))
    prefix = "law." if hasattr(law, "law") else ""
    bounds = {
        leaf.path: [float(x) if np.isfinite(x) else None for x in leaf.declared.bounds]
        for leaf in inner
    }
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
        "gains": [
            {
                **dataclasses.asdict(gain),
                "path": f"{prefix}{gain.path}",
                "bounds": bounds[gain.path],
            }
            for gain in controller.gains
        ],
    }


def _law_program(law: am.engine.ControlLaw, *, sample: bool, slopes: bool) -> str:
    """The functions of a control law; its parameters are the vector p, in the order of its
    leaves.
    """
    traced = trace_sample(law)
    arguments = {
        "y": traced.measured,
        "r": traced.setpoints,
        "m": traced.memory,
        "T": traced.sample_time,
        "l": traced.minimum,
        "h": traced.maximum,
        "p": traced.parameters,
    }
    printer = Printer(JavaScriptLanguage(exported=False))
    if sample:
        printer.add("sample", arguments, {"u": traced.commands, "n": traced.later})
    if slopes:
        results = [*traced.commands, *traced.later]
        table = jacobian(results, [*traced.measured, *traced.memory])
        printer.add("slopes", arguments, {"f": results, "D": by_row(table)})
    return _module(
        printer, [name for name, wanted in (("sample", sample), ("slopes", slopes)) if wanted]
    )


def _linear_program(plant: am.Plant, columns: tuple[str, ...]) -> str:
    """The linearisation of a plant for the columns that control laws measure. Raises ParameterError
    for a column that depends on an input at once."""
    compiled = compile_system(plant)
    traced = compiled.program.traced
    states = compiled.description.state_names
    known = dict(zip((*traced.output_names, *states), [*traced.o, *traced.x], strict=True))
    measured = [known[name] for name in columns]
    if any(nodes.occurring(measured, traced.u)):
        raise ParameterError(
            f"a column among {', '.join(columns)} depends on an input at once; it cannot be"
            " measured."
        )
    outputs = {
        "f": traced.f,
        "A": by_row(jacobian(traced.f, traced.x)),
        "B": by_row(jacobian(traced.f, traced.u)),
        "C": by_row(jacobian(measured, traced.x)),
    }
    printer = Printer(JavaScriptLanguage(exported=False))
    printer.add("linear", traced.point, outputs)
    return _module(printer, ["linear"])


def _pair_program(plant: am.Plant) -> str:
    """The statics of a joint as a function of the angle and of both pressures, and the torque [N m]
    of the muscles without their dampers for an angle, its speed and acceleration, and both
    pressures."""
    x = nodes.symbols("x", 3)
    angle, *pressures = x
    both = [
        function.at(angle, pressure)
        for function, pressure in zip(torque_functions(plant), pressures, strict=True)
    ]
    torque, stiffness, shut = (
        both[0][name] + both[1][name] for name in ("torque", "stiffness", "shut_valves")
    )
    by_muscle = [
        muscle[name]
        for name in ("torque_by_pressure", "stiffness_by_pressure", "tension")
        for muscle in both
    ]
    load = load_function(plant).at(angle)
    values = [torque, stiffness, *by_muscle, shut, load["torque"], load["slope"]]
    printer = Printer(JavaScriptLanguage(exported=False))
    printer.add("pair", {"x": x}, {"f": values})
    printer.add("needed", *_needed_torque(plant))
    return _module(printer, ["pair", "needed"])


def _needed_torque(plant: am.Plant) -> tuple[dict[str, list[Node]], dict[str, list[Node]]]:
    """Arguments (angle, speed, acceleration, pressures) and result of the function `needed`."""
    x = nodes.symbols("x", 5)
    angle, angular_speed, acceleration, *pressures = x
    mechanism = plant.mechanism
    lengths = plant.resting_lengths
    coordinate = mechanism.coordinates[0]
    q = {coordinate.name: angle}
    v = {coordinate.speed: angular_speed}
    contractions = nodes.as_nodes(mechanism.contractions(q, lengths))
    damping = []
    for muscle, length, contraction, pressure in zip(
        plant.muscles, lengths, contractions, pressures, strict=True
    ):
        speed = length * jacobian([contraction], [angle])[0][0] * angular_speed
        damping.append(-muscle.damper.force(pressure, contraction, speed))
    damping_torque = mechanism.generalised_forces(q, damping, lengths)[coordinate.name]
    needed = nodes.as_node(mechanism.driving_force(q, v, acceleration) - damping_torque)
    return {"x": x}, {"f": [needed]}


def _module(printer: Printer, names: list[str]) -> str:
    """The functions as an expression of JavaScript."""
    text = printer.module()
    return (
        f"(() => {{\n{text}\nreturn {{ {', '.join([*names, 'prepare'])}, held: {printer.held}"
        " };\n})()"
    )
