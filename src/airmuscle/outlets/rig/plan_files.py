"""Files of planned signals for a rig: C table, Python generator, MCAP, and the loop for Linux."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...bench import SignalPlan
from .mcap_file import mcap_bytes

TEMPLATES = Path(__file__).parent / "templates"
COMMANDS_FILE = "plan.csv"
TABLE_FILE = "plan.h"
GENERATOR_FILE = "plan.py"
BAG_FILE = "plan.mcap"
LOOP_FILE = "rig_loop.c"


def c_table(plan: SignalPlan) -> str:
    """The commands as a header of C99: rows of gauge pressures in Pa, with the limits."""
    limits = plan.limits
    rate = limits.max_rate if np.isfinite(limits.max_rate) else -1.0
    rows = ",\n".join("{" + ", ".join(f"{v:.1f}f" for v in row) + "}" for row in plan.commands)
    names = ", ".join(plan.inputs)
    return (
        f"/* Planned signals: {names}. Gauge pressures [Pa], each held until the next row. */\n"
        "#ifndef PLAN_H\n#define PLAN_H\n"
        f"#define PLAN_ROWS {len(plan.commands)}\n"
        f"#define PLAN_COMMANDS {len(plan.inputs)}\n"
        f"#define PLAN_SAMPLE_TIME_NS {round(1e9 * plan.sample_time)}L\n"
        f"#define PLAN_MAX_PRESSURE_PA {limits.max_pressure:.1f}f\n"
        f"#define PLAN_MIN_PRESSURE_PA {limits.min_pressure:.1f}f\n"
        f"#define PLAN_MAX_RATE_PA_PER_S {rate:.1f}f /* -1: not limited */\n"
        f"static const float plan_pressure_pa[PLAN_ROWS][PLAN_COMMANDS] = {{\n{rows}}};\n"
        "#endif\n"
    )


def signal_files(plan: SignalPlan) -> dict[str, str | Callable[[Path], object]]:
    """The files of a plan beside its table of commands, by name."""
    columns = dict(zip(plan.inputs, plan.commands.T, strict=True))
    return {
        TABLE_FILE: c_table(plan),
        GENERATOR_FILE: (TEMPLATES / "plan_generator.txt").read_text(encoding="utf-8"),
        BAG_FILE: lambda path: path.write_bytes(mcap_bytes(plan.times, columns)),
        LOOP_FILE: (TEMPLATES / LOOP_FILE).read_text(encoding="utf-8"),
    }
