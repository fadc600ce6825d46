"""Variables of an FMU: time, states, rates, inputs, outputs, parameters and the tolerance, with
their value references and units.

The value references follow each other in this order, as in the template `instance.h`; time is 0.
"""

import dataclasses
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from ...core import Leaf, ParameterError, printable
from ...engine.compile.function import Place
from ...engine.compile.program import Description
from .exported_run import ExportedRun
from .printed_system import meaning_of, per_second

PARAMETERS = "parameters"
TOLERANCE = "relative_tolerance"
START = "start"
"""Beginning of the names of parameters, name of the tolerance, and beginning of the names of
pressures at the start.
"""


@dataclasses.dataclass(frozen=True)
class Variable:
    """A variable with the attributes that both versions of FMI have."""

    name: str
    reference: int
    causality: str
    variability: str = "continuous"
    initial: str = ""
    start: float | None = None
    unit: str = ""
    description: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    derivative_of: int | None = None
    """The value reference of the state whose derivative the variable is."""
    nominal: float | None = None
    is_indicator: bool = False


class Variables(list[Variable]):
    """Variables by increasing value reference, from time on."""

    def __init__(self) -> None:
        super().__init__([Variable("time", 0, "independent", unit="s", description="time")])

    def add(self, name: str, causality: str, description: str, **attributes: Any) -> None:
        """Append a variable with the next value reference."""
        self.append(Variable(name, len(self), causality, description=description, **attributes))

    def add_parameters(self, tunable: Sequence[Leaf]) -> None:
        """Append parameters as tunable variables."""
        for leaf in tunable:
            self.append(
                Variable(
                    f"{PARAMETERS}.{leaf.path}",
                    len(self),
                    "parameter",
                    "tunable",
                    "exact",
                    float(leaf.value),
                    leaf.declared.unit,
                    f"{leaf.declared.symbol}: {leaf.declared.meaning}",
                    *leaf.declared.bounds,
                )
            )

    def checked(self) -> list[Variable]:
        """The variables, of which pressures state gauge or absolute. Raises ParameterError for two
        of one name.
        """
        for name, count in Counter(variable.name for variable in self).items():
            if count > 1:
                raise ParameterError(
                    f"the FMU would have two variables '{name}'; rename the muscle or signal of"
                    " this name."
                )
        stated = []
        for v in self:
            name = printable(v.name)
            about = printable(v.description)
            unit = v.unit.replace("Pa(a)", "Pa")
            kind = "absolute" if unit != v.unit else "gauge"
            is_stated = any(word in about for word in ("gauge", "absolute"))
            if (
                unit == "Pa"
                and not is_stated
                and ("pressure" in f"{name} {about}" or kind == "absolute")
            ):
                about = f"{about or 'pressure'}, {kind}"
            stated.append(dataclasses.replace(v, name=name, description=about, unit=unit))
        return stated


def make_variables(
    program: ExportedRun, indicators: int, starts: Mapping[str, float]
) -> list[Variable]:
    """The variables of an FMU, by increasing value reference, with the pressures of muscles [Pa] at
    the start by their columns, and so many event indicators at the end. Raises ParameterError for
    two variables of one name.
    """
    variables = Variables()
    units = program.system.units
    known = program.system.compiled.system
    for state, start in zip(known.states, program.problem.initial_vector.tolist(), strict=True):
        facts = {"unit": state.unit, "nominal": state.nominal}
        variables.add(state.name, "output", state.meaning, initial="exact", start=start, **facts)
    for i, state in enumerate(known.states, 1):
        name = f"der({state.name})"
        about = f"derivative of {state.name}"
        unit = per_second(state.unit)
        variables.add(name, "local", about, initial="calculated", unit=unit, derivative_of=i)
    for variable, start in zip(known.input_variables, program.first_inputs, strict=True):
        limits = {"minimum": variable.minimum, "maximum": variable.maximum}
        variables.add(
            variable.name, "input", variable.meaning, start=start, unit=variable.unit, **limits
        )
    for name in program.system.known.output_names:
        variables.add(name, "output", meaning_of(name), initial="calculated", unit=units[name])
    variables.add_parameters(program.system.tunable)
    exact = {"causality": "parameter", "initial": "exact"}
    if program.tolerance is not None:
        about = "relative tolerance of the integrator in Co-Simulation"
        variables.add(
            TOLERANCE, description=about, variability="tunable", start=program.tolerance, **exact
        )
    for column, pressure in starts.items():
        about = (
            "gauge pressure of the muscle at the start, from which its air mass follows; other"
            " states are kept"
        )
        name = f"{START}.{column}"
        variables.add(
            name, description=about, variability="fixed", start=pressure, unit="Pa", **exact
        )
    for i in range(1, indicators + 1):
        about = "changes its sign where the rates are not smooth"
        variables.add(f"event_indicator[{i}]", "local", about, is_indicator=True)
    return variables.checked()


def references_of(known: Description, place: Place) -> tuple[int, int]:
    """The value references of the rate or output, and of the state or input, of a partial
    derivative.
    """
    n = len(known.state_names)
    m = len(known.input_names)
    row, column = place
    unknown = 1 + n + row if row < n else 1 + 2 * n + m + row - n
    return unknown, 1 + column if column < n else 1 + 2 * n + column - n


BASE: dict[str, dict[str, int]] = {
    "m": {"m": 1},
    "s": {"s": 1},
    "kg": {"kg": 1},
    "K": {"K": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "Hz": {"s": -1},
}
"""Powers of the base units in the units of which the units of columns and parameters consist."""
_ATOM = re.compile(r"([A-Za-z]+)(?:\^?(-?\d+))?$")


def base_powers(unit: str) -> dict[str, int] | None:
    """The powers of the base units in a unit such as `m3/(s Pa)`; None where they are not known."""
    numerator, *denominators = unit.replace("Pa(a)", "Pa").split("/")
    powers: dict[str, int] = {}
    signs = [(numerator, 1)]
    signs += [(denominator.strip("()"), -1) for denominator in denominators]
    for part, sign in signs:
        for word in part.replace("*", " ").split():
            atom = _ATOM.match(word)
            if word == "1":
                continue
            if atom is None or atom[1] not in BASE:
                return None
            exponent = sign * int(atom[2] or 1)
            for base, power in BASE[atom[1]].items():
                powers[base] = powers.get(base, 0) + power * exponent
    if "" in denominators:
        return None
    return {base: power for base, power in powers.items() if power}


def add_units(parent: Element, units: Iterable[str]) -> None:
    """The element UnitDefinitions with these units, each once."""
    names = sorted({unit for unit in units if has_unit(unit)})
    definitions = SubElement(parent, "UnitDefinitions") if names else parent
    for name in names:
        element = SubElement(definitions, "Unit", name=name)
        powers = base_powers(name)
        if powers is not None:
            SubElement(element, "BaseUnit", {base: str(power) for base, power in powers.items()})


def has_unit(unit: str) -> bool:
    """Whether a quantity has a unit in an FMU; a ratio has none."""
    return unit not in ("", "1")
