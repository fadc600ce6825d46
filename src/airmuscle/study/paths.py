"""The numbers of a scenario that a study may vary, by their paths.

Of the plant every declared parameter, as `airmuscle.tree.leaves` names it: `circuit.fill.conductance`. Of the other
tables what is a number there: `command.fill[0][1]` (the value of the first point, [0][0] its instant), `run.duration`,
`run.start.pressure`, `run.method.rtol`.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.equilibrium import find_equilibrium_of_each
from ..control.control_loop import ControlLoop
from ..core.arrays import Array
from ..core.declaration import parameters
from ..core.errors import ParameterError, suggestion
from ..core.tree import flatten, leaves, with_parameters
from ..library.location import Location
from ..library.models import model_class
from ..plant.plant import Plant
from ..scenario.controller import numbers_of
from ..scenario.scenario import Scenario, pressure_of_rest, scenario_from, units_of_run

Keys = tuple[str | int, ...]


@dataclasses.dataclass(frozen=True)
class ScenarioParameter:
    """One number of a scenario: its path, its unit, its bounds, and where it stands: a leaf's place, or keys."""

    path: str
    unit: str
    bounds: tuple[float, float]
    location: int | Keys


@dataclasses.dataclass(frozen=True, eq=False)
class ScenarioTemplate:
    """The scenario of a study: its tables, where they stand, and what they describe before anything is varied."""

    tables: Mapping[str, Any]
    location: Location
    scenario: Scenario

    def parameters(self) -> dict[str, ScenarioParameter]:
        """Everything that can vary, by path."""
        plant, told = self.scenario.plant, self.tables.get("command", {})
        found = [
            ScenarioParameter(leaf.path, leaf.declared.unit, leaf.declared.bounds, i)
            for i, leaf in enumerate(leaves(plant))
        ]
        for keys, unit in (*_input_parameters(told, self.scenario), *_run_parameters(self.tables["run"], plant)):
            found.append(ScenarioParameter(_format_path(keys), unit, (-math.inf, math.inf), keys))
        return {number.path: number for number in found}

    def parameter(self, path: str, where: str) -> ScenarioParameter:
        """The number of this path. Raises ParameterError, with the nearest one."""
        known = self.parameters()
        if path not in known:
            near = suggestion(path, known) or f" There are {', '.join(known)}."
            raise ParameterError(f"{where}: the scenario has no number '{path}'.{near}")
        return known[path]

    def initial_states(self, numbers: Sequence[ScenarioParameter], values: Array) -> list[dict[str, float] | None]:
        """Where each of several runs with other values (R, d) begins, found for all at once; None for one that is to be
        asked alone. Values are not checked."""
        from ..compile.program import compile_system  # CasADi, which reading a study does not need

        plant, alone = self.scenario.plant, [None] * len(values)
        pressure = pressure_of_rest(self.tables, self.location)
        if pressure is None or any(
            not isinstance(n.location, int) and n.location[:2] == ("run", "start") for n in numbers
        ):
            return list(alone)
        leaves_of_each = np.repeat(flatten(plant)[None, :], len(values), axis=0)
        for number, column in zip(numbers, values.T, strict=True):
            if isinstance(number.location, int):
                leaves_of_each[:, number.location] = column
        pressures, inputs = (pressure,) * len(plant.muscles), np.zeros(len(plant.inputs))
        found = find_equilibrium_of_each(compile_system(plant), leaves_of_each, pressures, inputs).states
        names = [s.name for s in plant.states]
        return [dict(zip(names, x, strict=True)) if np.isfinite(x).all() else None for x in found.tolist()]

    def with_values(
        self, numbers: Sequence[ScenarioParameter], values: Sequence[float], rest: dict[str, float] | None = None
    ) -> Scenario:
        """The scenario with other values, checked as if they stood in its file; the start is found anew unless it is
        given as `rests` finds it."""
        scenario, tables = self.scenario, self.tables
        leaf_values = flatten(scenario.plant).tolist()
        for number, value in zip(numbers, values, strict=True):
            if isinstance(number.location, int):
                leaf_values[number.location] = float(value)
            else:
                tables = _replace_number(tables, number.location, float(value))
        # a reason must read the same on every machine, so it names the file without its folder
        place = dataclasses.replace(self.location, file=Path(self.location.file).name)
        return scenario_from(tables, place, with_parameters(scenario.plant, leaf_values), rest)


def _input_parameters(table: Mapping[str, Any], scenario: Scenario) -> Iterator[tuple[Keys, str]]:
    units = units_of_run(scenario.plant, scenario.start, scenario.command)
    for name, given in table.items():
        if isinstance(scenario.command, ControlLoop) and name == "controller":
            yield from ((("command", name, *keys), unit) for keys, unit in numbers_of(given, scenario.command, units))
        elif name == "period":
            yield ("command", name), "s"
        elif isinstance(given, list):
            for i, _ in enumerate(given):
                yield ("command", name, i, 0), "s"
                yield ("command", name, i, 1), units[name]
        elif isinstance(given, Mapping):
            yield from _model_parameters(given, ("command", name))


def _run_parameters(table: Mapping[str, Any], plant: Plant) -> Iterator[tuple[Keys, str]]:
    for name in ("duration", "start_time", "output"):
        if name in table:
            yield ("run", name), "s"
    yield ("run", "start", "pressure"), "Pa"
    for c in plant.mechanism.coordinates:
        yield ("run", "start", c.name), c.unit
        yield ("run", "start", c.speed), f"{c.unit}/s"
    yield from _model_parameters(table.get("method"), ("run", "method"))


def _model_parameters(given: Any, keys: Keys) -> Iterator[tuple[Keys, str]]:
    """The declared parameters of every model that stands in a table, or in a list or table inside it."""
    if isinstance(given, list):
        for i, item in enumerate(given):
            yield from _model_parameters(item, (*keys, i))
    elif isinstance(given, Mapping):
        if isinstance(given.get("model"), str):
            for declared in parameters(model_class(given["model"], _format_path(keys))):
                yield (*keys, declared.name), declared.unit
        for name, item in given.items():
            yield from _model_parameters(item, (*keys, name))


def _format_path(keys: Keys) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")


def _replace_number(tables: Mapping[str, Any], keys: Keys, value: float) -> Mapping[str, Any]:
    """A copy of the tables with one number put in; a table on the way that is missing is made."""
    changed: Any = copy.deepcopy(dict(tables))
    inner = changed
    for key in keys[:-1]:
        inner = inner.setdefault(key, {}) if isinstance(inner, dict) else inner[key]
    inner[keys[-1]] = value
    return dict(changed)
