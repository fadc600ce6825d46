"""Contender of a scenario: the control law of a scenario file for the joint of the control benchmark."""

from __future__ import annotations

from pathlib import Path

from ...control.laws.cascade import Cascade
from ...control.laws.co_contraction import DIFFERENCE
from ...core.errors import ParameterError
from ...engine.loop.control_law import ControlLaw
from ...engine.loop.sensors import WithSensors
from ..tuning.scenario_loop import load_scenario_loop
from .contenders import Contender
from .joints import BenchmarkJoint


def scenario_contender(joint: BenchmarkJoint, path: str | Path) -> Contender:
    """The contender of a scenario file: its control law, with the ranges of its gains that `airmuscle tune` has.

    The benchmark has its own sensors and, for a law that commands pressures, its own pressure control: `WithSensors`
    around the law is removed, and of a `Cascade` whose inputs the joint does not have the outer law is taken. Raises
    FileError, ParameterError, UnitError or UnknownNameError with the location; ParameterError for a law that commands
    none of half the pressure difference, the pressures and the valves of the joint.
    """
    scenario = load_scenario_loop(path)
    law, prefix = scenario.loop.controller, ""
    allowed = {DIFFERENCE}, set(joint.pressures), set(joint.model.inputs) - {"external_torque"}
    while isinstance(law, WithSensors | Cascade) and (isinstance(law, WithSensors) or set(law.inputs) not in allowed):
        name, law = ("law", law.law) if isinstance(law, WithSensors) else ("outer", law.outer)
        prefix = f"{prefix}{name}."
    if not isinstance(law, ControlLaw) or set(law.inputs) not in allowed:
        raise ParameterError(
            f"{scenario.location.inside('input').inside('controller')}: the law commands {', '.join(law.inputs)}; "
            f"allowed are '{DIFFERENCE}', the pressures {', '.join(joint.pressures)}, or all valves "
            f"{', '.join(sorted(allowed[2]))}."
        )
    bounds = {key.removeprefix(prefix): pair for key, pair in scenario.bounds().items() if key.startswith(prefix)}
    return Contender(Path(path).stem, law, bounds)
