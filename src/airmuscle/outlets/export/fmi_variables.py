"""Variables of an FMU: time, states, rates, inputs, outputs, parameters and the tolerance, with their value references
and units.

The value references follow each other in this order, as in the template `instance.h`; time is 0.
"""

import dataclasses
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from ...core import Leaf, ParameterError, printable
from ...engine.compile.function import Place
from ...engine.run.integrators import Rodas4
from ...recording.columns import quantity_of
from .exported_run import RunData
from .printed_system import ExportedSystem, per_second

PARAMETERS, TOLERANCE, START = "parameters", "relative_tolerance", "start"
"""Beginning of the names of parameters, name of the tolerance, and beginning of the names of pressures at the start."""


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


def make_variables(
    system: ExportedSystem, run: RunData, indicators: int = 0, starts: Mapping[str, float] | None = None
) -> list[Variable]:
    """The variables of an FMU, by increasing value reference, with so many event indicators at the end.

    starts  pressures of muscles [Pa] at the start by their columns

    Raises ParameterError for two variables of one name.
    """
    variables = [Variable("time", 0, "independent", unit="s", description="time")]
    units, known = system.units, system.compiled.system

    def add(name: str, causality: str, **attributes: object) -> None:
        variables.append(Variable(name, len(variables), causality, **attributes))  # type: ignore[arg-type]

    for state, start in zip(known.states, run.initial.tolist(), strict=True):
        texts = {"unit": state.unit, "description": state.meaning}
        add(state.name, "output", initial="exact", start=start, nominal=state.nominal, **texts)
    for i, state in enumerate(known.states, 1):
        unit = per_second(state.unit)
        about = f"derivative of {state.name}"
        add(f"der({state.name})", "local", initial="calculated", unit=unit, derivative_of=i, description=about)
    for given, start in zip(known.input_variables, first_inputs(run), strict=True):
        limits = {"minimum": given.minimum, "maximum": given.maximum}
        add(given.name, "input", start=start, unit=given.unit, description=given.meaning, **limits)
    for name in system.output_names:
        known_quantity = quantity_of(name)
        about = known_quantity.meaning if known_quantity else ""
        add(name, "output", initial="calculated", unit=units[name], description=about)
    variables += parameter_variables(system.tunable, len(variables))
    if isinstance(run.integrator, Rodas4):
        about = "relative tolerance of the integrator in Co-Simulation"
        start = run.integrator.rtol
        add(TOLERANCE, "parameter", variability="tunable", initial="exact", start=start, description=about)
    for column, pressure in (starts or {}).items():
        about = "gauge pressure of the muscle at the start, from which its air mass follows; other states are kept"
        add(f"{START}.{column}", "parameter", variability="fixed", initial="exact", start=pressure, unit="Pa",
            description=about)  # fmt: skip
    for i in range(1, indicators + 1):
        about = "changes its sign where the rates are not smooth"
        add(f"event_indicator[{i}]", "local", is_indicator=True, description=about)
    return checked(variables)


def parameter_variables(tunable: Sequence[Leaf], first: int) -> list[Variable]:
    """Parameters as tunable variables, whose value references follow each other from `first` on."""
    return [
        Variable(
            f"{PARAMETERS}.{leaf.path}", first + i, "parameter", "tunable", "exact", float(leaf.value),
            leaf.declared.unit, f"{leaf.declared.symbol}: {leaf.declared.meaning}", *leaf.declared.bounds,
        )
        for i, leaf in enumerate(tunable)
    ]  # fmt: skip


def _stated(v: Variable) -> Variable:
    """The variable with a unit that importers know, and a description that states gauge or absolute."""
    name, about, unit = printable(v.name), printable(v.description), v.unit.replace("Pa(a)", "Pa")
    kind = "absolute" if unit != v.unit else "gauge"
    is_stated = any(word in about for word in ("gauge", "absolute"))
    if unit == "Pa" and not is_stated and ("pressure" in f"{name} {about}" or kind == "absolute"):
        about = f"{about or 'pressure'}, {kind}"
    return dataclasses.replace(v, name=name, description=about, unit=unit)


def first_inputs(run: RunData) -> list[float]:
    """The inputs at the beginning of the run."""
    values: list[float] = run.segments.values[0].tolist()
    return values


def references_of(system: ExportedSystem, place: Place) -> tuple[int, int]:
    """The value references of the rate or output, and of the state or input, of a partial derivative."""
    n, m = len(system.state_names), len(system.input_names)
    row, column = place
    unknown = 1 + n + row if row < n else 1 + 2 * n + m + row - n
    return unknown, 1 + column if column < n else 1 + 2 * n + column - n


def checked(variables: list[Variable]) -> list[Variable]:
    """The variables with stated units. Raises ParameterError for two of one name."""
    seen: set[str] = set()
    for variable in variables:
        if variable.name in seen:
            raise ParameterError(
                f"the FMU would have two variables '{variable.name}'; rename the muscle or signal of this name."
            )
        seen.add(variable.name)
    return [_stated(v) for v in variables]


BASE: dict[str, dict[str, int]] = {
    "m": {"m": 1}, "s": {"s": 1}, "kg": {"kg": 1}, "K": {"K": 1}, "rad": {"rad": 1}, "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2}, "W": {"kg": 1, "m": 2, "s": -3},
    "Hz": {"s": -1},
}  # fmt: skip
"""Powers of the base units in the units of which the units of columns and parameters consist."""
_ATOM = re.compile(r"([A-Za-z]+)(?:\^?(-?\d+))?$")


def base_powers(unit: str) -> dict[str, int] | None:
    """The powers of the base units in a unit such as `m3/(s Pa)`; None where they are not known."""
    numerator, *denominators = unit.replace("Pa(a)", "Pa").split("/")
    powers: dict[str, int] = {}
    for part, sign in ((numerator, 1), *((text.strip("()"), -1) for text in denominators)):
        for word in part.replace("*", " ").split():
            atom = _ATOM.match(word)
            if word == "1":
                continue
            if atom is None or atom[1] not in BASE:
                return None
            for base, power in BASE[atom[1]].items():
                powers[base] = powers.get(base, 0) + sign * power * int(atom[2] or 1)
    if "" in denominators:
        return None
    return {base: power for base, power in powers.items() if power}


def add_units(parent: Element, units: Iterable[str]) -> None:
    """The element UnitDefinitions with these units, each once."""
    names = sorted({unit for unit in units if has_unit(unit)})
    if not names:
        return
    definitions = SubElement(parent, "UnitDefinitions")
    for name in names:
        element, powers = SubElement(definitions, "Unit", name=name), base_powers(name)
        if powers is not None:
            SubElement(element, "BaseUnit", {base: str(power) for base, power in powers.items()})


def has_unit(unit: str) -> bool:
    """Whether a quantity has a unit in an FMU; a ratio has none."""
    return unit not in ("", "1")
