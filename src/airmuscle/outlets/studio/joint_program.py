"""Printed programs of the tab Joint: a sample of a control law with its derivatives, the plant linearised, and statics.

The functions write into arrays that they are given; c is what `prepare(p, c)` made of the parameters:

    sample(y, r, m, T, l, h, c, u, n)   measurements, set points, memory, sample time [s], ranges of the commands:
                                        commands and later memory
    slopes(y, r, m, T, l, h, c, f, D)   the same with f = (u, n), and D = df/d(y, m), row by row
    linear(x, u, c, f, A, B, C)         rates f, df/dx, df/du, and the derivatives of columns by x, row by row
    pair(x, f)                          x = (angle, p_1, p_2), f = PAIR
    cut_segments(...)                   the kernel of `driven_inputs`, with its arguments
    needed(x, f)                        x = (angle, angular speed, angular acceleration, p_1, p_2), f = torque that the
                                        muscles must give, with that of their dampers
"""

from __future__ import annotations

from typing import Any

import airmuscle as am

from ...core import tree
from ...core.errors import ParameterError
from ...engine.compile.functions import Printer, TracedSystem
from ...engine.compile.kernel_text import JavaScriptKernels
from ...engine.compile.text.javascript import JavaScriptLanguage
from ...engine.run.compiled_law import trace_sample
from ...physics.analysis.joint_torque import load_function, torque_functions

PAIR = (
    "torque", "stiffness", "torque_by_first", "torque_by_second", "stiffness_by_first", "stiffness_by_second",
    "tension_first", "tension_second", "shut_valves", "load", "load_slope",
)  # fmt: skip
"""Results of `pair`, in SI units: sums over both muscles, tensions, and the torque of weights and springs."""


def inputs_program() -> str:
    """The kernel that cuts the inputs which no controller commands into the segments of a sample."""
    text = JavaScriptKernels().text("driven_inputs", ["cut_segments"])
    return f"(() => {{\n{text}\nreturn {{ cut_segments }};\n}})()"


def law_program(law: am.engine.ControlLaw, *, sample: bool, slopes: bool) -> str:
    """The functions of a control law; its parameters are the vector p, in the order of its leaves."""
    import casadi

    traced = trace_sample(law)
    p = casadi.SX.sym("p", sum(1 for _ in tree.leaves(law)))
    commands, later = casadi.substitute([traced.commands, traced.later], [traced.parameters], [p])
    commands, later = casadi.cse([casadi.densify(commands), casadi.densify(later)])
    arguments = {"y": traced.measured, "r": traced.setpoints, "m": traced.memory, "T": traced.sample_time,
                 "l": traced.minimum, "h": traced.maximum, "p": p}  # fmt: skip
    printer = Printer(JavaScriptLanguage(exported=False))
    if sample:
        printer.add("sample", arguments, {"u": commands, "n": later})
    if slopes:
        both = casadi.vertcat(commands, later)
        by = casadi.vertcat(traced.measured, traced.memory)
        table = casadi.densify(casadi.vec(casadi.jacobian(both, by).T))
        printer.add("slopes", arguments, {"f": both, "D": casadi.cse(table)})
    return _module(printer, [name for name, wanted in (("sample", sample), ("slopes", slopes)) if wanted])


def linear_program(traced: TracedSystem, state_names: tuple[str, ...], columns: tuple[str, ...]) -> str:
    """The linearisation of a traced system for the columns that control laws measure.

    Raises ParameterError for a column that depends on an input at once.
    """
    import casadi

    rows = []
    for name in columns:
        known = name in state_names
        rows.append(traced.x[state_names.index(name)] if known else traced.o[traced.output_names.index(name)])
    measured = casadi.vertcat(*rows)
    if any(casadi.which_depends(measured, traced.u, 1, False)):
        raise ParameterError(f"a column among {', '.join(columns)} depends on an input at once; it cannot be measured.")
    tables = {
        "A": casadi.jacobian(traced.f, traced.x),
        "B": casadi.jacobian(traced.f, traced.u),
        "C": casadi.jacobian(measured, traced.x),
    }
    printer = Printer(JavaScriptLanguage(exported=False))
    outputs = {"f": traced.f, **{name: casadi.densify(casadi.vec(table.T)) for name, table in tables.items()}}
    values = casadi.cse(list(outputs.values()))
    printer.add("linear", {"x": traced.x, "u": traced.u, "p": traced.p}, dict(zip(outputs, values, strict=True)))
    return _module(printer, ["linear"])


def pair_program(plant: am.Plant) -> str:
    """The statics of a joint as a function of the angle and of both pressures, and the torque that a motion needs."""
    import casadi

    x = casadi.SX.sym("x", 3)
    names = ("torque", "stiffness", "torque_by_pressure", "stiffness_by_pressure", "tension", "shut_valves")
    first, second = (
        dict(zip(function.row.names, casadi.horzsplit(function.row.function(x[0], x[i])), strict=True))
        for i, function in enumerate(torque_functions(plant), 1)
    )
    torque, stiffness, by_pressure, bending, tension, shut = names
    load = load_function(plant).function(x[0])
    values = [
        first[torque] + second[torque], first[stiffness] + second[stiffness], first[by_pressure], second[by_pressure],
        first[bending], second[bending], first[tension], second[tension], first[shut] + second[shut], load[0], load[1],
    ]  # fmt: skip
    printer = Printer(JavaScriptLanguage(exported=False))
    printer.add("pair", {"x": x}, {"f": casadi.cse(casadi.densify(casadi.vertcat(*values)))})
    motion = casadi.SX.sym("x", 5)
    printer.add("needed", {"x": motion}, {"f": casadi.cse(casadi.densify(_needed_torque(plant, motion)))})
    return _module(printer, ["pair", "needed"])


def _needed_torque(plant: am.Plant, x: Any) -> Any:
    """Torque [N m] of the muscles without their dampers for an angle, its speed and acceleration, and two pressures."""
    import casadi

    mechanism, lengths = plant.mechanism, plant.resting_lengths
    coordinate = mechanism.coordinates[0]
    q, v = {coordinate.name: x[0]}, {coordinate.speed: x[1]}
    rest = dict.fromkeys((each.name for each in mechanism.inputs), 0.0)
    free, driven = (mechanism.acceleration(q, v, {coordinate.name: t}, rest)[coordinate.name] for t in (0.0, 1.0))
    contractions = mechanism.contractions(q, lengths)
    damping = []
    for muscle, length, contraction, pressure in zip(plant.muscles, lengths, contractions, (x[3], x[4]), strict=True):
        speed = length * casadi.jacobian(casadi.SX(contraction), x[0]) * x[1]
        damping.append(-muscle.damper.force(pressure, contraction, speed))
    held = mechanism.generalised_forces(q, damping, lengths)[coordinate.name]
    return casadi.SX((x[2] - free) / (driven - free) - held)


def _module(printer: Printer, names: list[str]) -> str:
    """The functions as an expression of JavaScript."""
    text = printer.module()
    return f"(() => {{\n{text}\nreturn {{ {', '.join([*names, 'prepare'])}, held: {printer.held} }};\n}})()"
