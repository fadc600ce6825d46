"""Parameter paths: the numbers of a scenario that a study may vary; docs/guides/study.md.

The unit of a field of designs, distributions and metrics is that of the varied parameter, or of the
evaluated column: such a field is declared with `custom_field` and one of the readers, which receive
that unit.
"""

import copy
import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...core import ABSOLUTE, Array, ParameterError, abridged, check_known, parameters, quantity
from ...core.absolute_pressure import AbsolutePressure, ambient_pressure
from ...core.tree import absolute_pressures, flatten, leaves, with_parameters
from ...engine.loop.control_loop import ControlLoop
from ...files.library import Location, model_class, read_finite_number
from ...files.scenario.controller import controller_number_paths
from ...files.scenario.scenario import (
    Scenario,
    build_scenario,
    initial_pressure,
    run_column_units,
    scenario_tables,
)
from ...physics.equilibrium import find_equilibrium_of_each

Keys = tuple[str | int, ...]
"""Nested keys of a number in the tables of a scenario."""


@dataclasses.dataclass(frozen=True)
class ScenarioParameter:
    """A number of a scenario: path, unit, bounds, and location: the index of a leaf of the plant,
    or nested keys.
    """

    path: str
    unit: str
    bounds: tuple[float, float]
    location: int | Keys


@dataclasses.dataclass(frozen=True, eq=False)
class ScenarioTemplate:
    """The nominal scenario of a study, its tables and their location in the file."""

    tables: Mapping[str, Any]
    location: Location
    scenario: Scenario

    def parameters(self) -> dict[str, ScenarioParameter]:
        """All parameters that may vary, by path."""
        declared = ((leaf.path, leaf.declared) for leaf in leaves(self.scenario.plant))
        known = {
            path: ScenarioParameter(path, d.unit, d.bounds, i)
            for i, (path, d) in enumerate(declared)
        }
        of_input = _input_parameters(self.tables.get("input", {}), self.scenario)
        for keys, unit in (*of_input, *_run_parameters(self.tables["run"], self.scenario)):
            known[_format_path(keys)] = ScenarioParameter(
                _format_path(keys), unit, (-math.inf, math.inf), keys
            )
        return known

    def parameter(self, path: str, where: str) -> ScenarioParameter:
        """The parameter with a path. Raises ParameterError with the closest path."""
        known = self.parameters()
        check_known(f"{where}: the scenario has no parameter", path, known, "its parameters are")
        return known[path]

    def initial_states(
        self, varied: Sequence[ScenarioParameter], values: Array
    ) -> list[dict[str, float] | None]:
        """The initial equilibria of several runs with other parameter values (R, d), computed
        together.

        None for a run whose initial state must be computed individually. The values are not
        validated.
        """
        plant = self.scenario.plant
        pressure = initial_pressure(self.tables, self.location, plant)
        if pressure is None or any(
            (
                p.location[:2] == ("run", "initial_state")
                if not isinstance(p.location, int)
                else p.unit == ABSOLUTE and isinstance(pressure, AbsolutePressure)
            )
            for p in varied
        ):
            return [None] * len(values)
        leaf_values = np.repeat(flatten(plant)[None, :], len(values), axis=0)
        of_plant = {
            p.path: column
            for p, column in zip(varied, values.T, strict=True)
            if isinstance(p.location, int)
        }
        of_plant |= absolute_pressures(plant, of_plant)
        for place, leaf in enumerate(leaves(plant)):
            if leaf.path in of_plant:
                leaf_values[:, place] = of_plant[leaf.path]
        pressures = (pressure,) * len(plant.muscles)
        inputs = np.zeros(len(plant.inputs))
        states = find_equilibrium_of_each(
            self.scenario.problem.compiled, leaf_values, pressures, inputs
        )
        names = [s.name for s in plant.states]
        return [
            dict(zip(names, x, strict=True)) if np.isfinite(x).all() else None
            for x in states.tolist()
        ]

    def with_values(
        self,
        varied: Sequence[ScenarioParameter],
        values: Sequence[float],
        initial_state: dict[str, float] | None = None,
    ) -> Scenario:
        """The scenario with other parameter values, validated as if they were in its file.

        The initial state is computed, unless `initial_state` is given. Raises ParameterError or
        PhysicsError.
        """
        scenario = self.scenario
        tables = self.tables
        leaf_values = [leaf.value for leaf in leaves(scenario.plant)]
        for parameter, value in zip(varied, values, strict=True):
            if isinstance(parameter.location, int):
                leaf_values[parameter.location] = float(value)
            else:
                tables = _replace_number(tables, parameter.location, float(value))
        # the failure reason must be the same on every machine and therefore names the file without
        # its folder
        location = dataclasses.replace(self.location, file=Path(self.location.file).name)
        return build_scenario(
            tables, location, with_parameters(scenario.plant, leaf_values), initial_state
        )


def changed_scenario(path: str | Path, changes: Mapping[str, str]) -> Scenario:
    """The scenario of a file or of a plant of the library with other numbers, by their paths: texts
    with a unit.

    Raises ParameterError for a path that the scenario does not have, and others as `load_scenario`.
    """
    tables, location = scenario_tables(path)
    template = ScenarioTemplate(tables, location, build_scenario(tables, location))
    varied = [template.parameter(name, str(location)) for name in changes]
    with ambient_pressure(template.scenario.plant.ambient.pressure):
        values = [
            quantity(changes[parameter.path], parameter.unit, where=parameter.path)
            for parameter in varied
        ]
    made = template.with_values(varied, values)
    return dataclasses.replace(
        made, title=f"{made.title}; {', '.join(f'{k} = {v}' for k, v in changes.items())}"
    )


def _input_parameters(table: Mapping[str, Any], scenario: Scenario) -> Iterator[tuple[Keys, str]]:
    """Keys and units of the numbers under [input]."""
    units = run_column_units(scenario.problem)
    for name, value in table.items():
        if isinstance(scenario.problem.input, ControlLoop) and name == "controller":
            for keys, unit in controller_number_paths(value, scenario.problem.input, units):
                yield ("input", name, *keys), unit
        elif name == "period":
            yield ("input", name), "s"
        elif isinstance(value, list):
            for i, _ in enumerate(value):
                yield ("input", name, i, 0), "s"
                yield ("input", name, i, 1), units[name]
        elif isinstance(value, Mapping):
            yield from _model_parameters(value, ("input", name))


def _run_parameters(table: Mapping[str, Any], scenario: Scenario) -> Iterator[tuple[Keys, str]]:
    """Keys and units of the numbers under [run]."""
    yield from (
        (("run", name), "s") for name in ("duration", "start_time", "output_times") if name in table
    )
    yield ("run", "initial_state", "pressure"), "Pa"
    for coordinate in scenario.plant.mechanism.coordinates:
        yield ("run", "initial_state", coordinate.name), coordinate.unit
        yield ("run", "initial_state", coordinate.speed), f"{coordinate.unit}/s"
    yield from _model_parameters(table.get("integrator"), ("run", "integrator"))


def _model_parameters(value: Any, keys: Keys) -> Iterator[tuple[Keys, str]]:
    """Keys and units of the declared parameters of all models in a table or list, at any depth."""
    if isinstance(value, list):
        for i, item in enumerate(value):
            yield from _model_parameters(item, (*keys, i))
    elif isinstance(value, Mapping):
        if isinstance(value.get("model"), str):
            for declared in parameters(model_class(value["model"], _format_path(keys))):
                yield (*keys, declared.name), declared.unit
        for name, item in value.items():
            yield from _model_parameters(item, (*keys, name))


def _format_path(keys: Keys) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")


def _replace_number(tables: Mapping[str, Any], keys: Keys, value: float) -> Mapping[str, Any]:
    """A copy of the tables with one number replaced; missing tables are created."""
    changed: Any = copy.deepcopy(dict(tables))
    inner = changed
    for key in keys[:-1]:
        inner = inner.setdefault(key, {}) if isinstance(inner, dict) else inner[key]
    inner[keys[-1]] = value
    return dict(changed)


_NUMBER = re.compile(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def read_difference(value: Any, unit: str, where: object) -> float:
    """A difference of two quantities, converted without the offset of its unit (degC, bara)."""
    zero = (
        read_finite_number(_NUMBER.sub("0", value, count=1), unit, where)
        if isinstance(value, str)
        else 0.0
    )
    return read_finite_number(value, unit, where) - zero


def read_count(value: Any, unit: str, where: object) -> int:
    """A non-negative integer."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ParameterError(f"{where} is {abridged(value)}; it must be a non-negative integer.")
    return value


def read_name(value: Any, unit: str, where: object) -> str:
    """A non-empty text."""
    if not isinstance(value, str) or not value:
        raise ParameterError(f"{where} is {abridged(value)}; it must be a quoted name.")
    return value
