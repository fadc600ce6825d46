"""C99 main program of a control loop: plant, controller and drivers from sample to sample, rows as CSV."""

from __future__ import annotations

from collections.abc import Sequence

from ...engine.compile.kernel_text import CKernels
from .c_source import csv_header
from .c_text import c_array, c_integers, c_number, c_string
from .exported_loop import ExportedLoop
from .printed_system import ExportedSystem
from .provenance import block_comment
from .run_data import RunData
from .templates import filled

NOT_COMMANDED = '         : status == NOT_COMMANDED      ? "a measurement or a command is not finite\\n"\n'
"""A further reason for which a control loop ends early."""

APPLY_DRIVERS = """  apply_drivers(driver_kinds, driver_settings, driver_states, driver_states, signals, counts,
                scratch, begin, nextafter(fabs(end), HUGE_VAL) - fabs(end));
"""
"""The lines that pass commands through their drivers."""


def loop_main(
    name: str, system: ExportedSystem, run: RunData, loop: ExportedLoop, columns: Sequence[str],
    provenance: Sequence[str],
) -> str:  # fmt: skip
    """A main program that runs a control loop and writes these columns, after time, as CSV."""
    drivers = len(loop.drivers.kinds)
    places = {
        "provenance": block_comment(provenance), "file": name, "rows": str(run.times.size),
        "samples": str(loop.samples), "segments": str(loop.others.ends.size),
        "pieces": str(loop.prepared.setpoint_signal.ends.size), "columns": str(len(columns)), "drivers": str(drivers),
        "capacity": str(loop.capacity), "apply_drivers": APPLY_DRIVERS if drivers else "",
        "kernels": CKernels(_shapes(f"{name.upper()}_INPUTS")).text("driven_inputs", loop.kernels),
        "valid": filled("valid.c", {}, name), "program": filled("program.c", {"failures": NOT_COMMANDED}, name),
        "constants": _constants(name, system, run, loop, columns),
    }  # fmt: skip
    return filled("loop.c", places, name)


def _shapes(inputs: str) -> dict[str, tuple[str, ...]]:
    """The sizes of the arrays of the printed kernels."""
    signal, table, common = ("", "CAPACITY"), ("DRIVERS", "4"), ("", inputs)
    return {
        "columns": (inputs, "3", "CAPACITY"), "scratch": ("2", "3", "CAPACITY"), "kinds": ("DRIVERS", "2"),
        **dict.fromkeys(("signal", "result", "events"), signal),
        **dict.fromkeys(("settings", "states", "later"), table),
        **dict.fromkeys(("values", "slopes"), common), "setpoint": ("SETPOINTS",), "command": ("COMMANDS",),
        **dict.fromkeys(("given_values", "given_slopes"), ("", f"{inputs} + 1")),
        **dict.fromkeys(("setpoint_values", "setpoint_slopes"), ("", "SETPOINTS + 1")),
    }  # fmt: skip


def _constants(name: str, system: ExportedSystem, run: RunData, loop: ExportedLoop, columns: Sequence[str]) -> str:
    upper, others, setpoints = name.upper(), loop.others, loop.prepared.setpoint_signal
    numbers = (
        ("SAMPLE_TIME", loop.sample_time), ("NEAR", loop.near), ("start", run.start),
        ("finish", float(loop.prepared.instants[-1])),
    )  # fmt: skip
    text = "".join(f"static const double {key} = {c_number(value)};\n" for key, value in numbers)
    text += f"static const char header[] = {c_string(csv_header(columns))};\n"
    text += "/* Kind of each column (state, input, output, set point, measurement, command), and its number there. */\n"
    text += c_integers("static const int columns[COLUMNS][2]", loop.column_at(system, columns))
    text += c_integers("static const int measured_at[MEASUREMENTS][2]", loop.measured_at(system))
    text += c_integers("static const int commanded[COMMANDS]", loop.prepared.commanded)
    text += c_array(f"static const double initial[{upper}_STATES]", run.initial)
    text += c_array("static const double times[ROWS]", run.times)
    for kind, signal, width in (("", others, f"{upper}_INPUTS"), ("setpoint_", setpoints, "SETPOINTS")):
        count = "PIECES" if kind else "SEGMENTS"
        text += c_array(f"static const double {kind}ends[{count}]", signal.ends)
        text += c_array(f"static double {kind}values[{count}][{width} + 1]", signal.values, 1)
        text += c_array(f"static double {kind}slopes[{count}][{width} + 1]", signal.slopes, 1)
    if len(loop.drivers.kinds):
        text += c_integers(
            "static int driver_kinds[DRIVERS][2]", [(int(i), int(kind)) for i, kind in loop.drivers.kinds]
        )
        text += c_array("static double driver_settings[DRIVERS][4]", loop.drivers.settings)
        text += c_array("static double driver_states[DRIVERS][4]", loop.driver_states)
        text += "static double scratch[2][3][CAPACITY];\n"
    return text
