"""A study written down as a file: a scenario, what varies in it, how it is sampled, and what is kept.

title = "Spread of two valves"                     optional
scenario = "fill_discharge.toml"                   a scenario file beside this one; or the tables [scenario.plant],
                                                   [scenario.command] and [scenario.run] of one
chunk = 32                                         optional: runs that are written together
[vary]                                             numbers by their paths, see varied.py
"mechanism.mass" = ["5 kg", "10 kg"]               levels; also { model = "Range", low = , high = , count = }
"circuit.fill.conductance" = { model = "Normal", mean = "...", deviation = "..." }       see variation.py
[follow]                                           optional: numbers that take the value of one that varies
"circuit.discharge.conductance" = "circuit.fill.conductance"
[design]
model = "LatinHypercube"                           see design.py
count = 256
seed = 1
[outcome]                                          see outcome.py
contraction = { model = "Final", column = "contraction" }
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.errors import ParameterError, suggestion
from ..library.catalogue import parsed
from ..library.location import Location, check_keys, located_errors, text
from ..scenario.scenario import Scenario, load_scenario, scenario_from, units_of_run
from .design import DESIGNS, Design
from .distributions import Variation, read_variation
from .fingerprint import fingerprint
from .metrics import METRICS, Metric, Scalar, TimeSeries
from .parse import chosen, whole
from .paths import ScenarioParameter, ScenarioTemplate

TABLES = ("title", "scenario", "chunk", "vary", "follow", "design", "outcome")
CHUNK_SIZE = 32
"""RunSplit that are written together unless the study says otherwise (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class Study:
    """Many runs of one scenario.

    `numbers` vary as `variations` say, in the runs that `design` makes of them: `values` (N, d), run by run.
    `follow` holds further numbers, each with the place (in `numbers`) of the one that it takes its value from.
    """

    title: str
    path: Path
    template: ScenarioTemplate
    parameters: tuple[ScenarioParameter, ...]
    variations: tuple[Variation, ...]
    follow: tuple[tuple[ScenarioParameter, int], ...]
    design: Design
    values: npt.NDArray[np.float64]
    metrics: Mapping[str, Metric]
    chunk_size: int = CHUNK_SIZE

    def __len__(self) -> int:
        return len(self.values)

    @property
    def scalars(self) -> dict[str, Scalar]:
        """The outcomes that are numbers."""
        return {name: outcome for name, outcome in self.metrics.items() if isinstance(outcome, Scalar)}

    @property
    def time_series(self) -> dict[str, TimeSeries]:
        """The outcomes that are whole columns."""
        return {name: outcome for name, outcome in self.metrics.items() if isinstance(outcome, TimeSeries)}

    @property
    def units(self) -> dict[str, str]:
        """The units of the outcomes."""
        known = column_units(self.template.scenario)
        return {name: outcome.unit(known[outcome.column]) for name, outcome in self.metrics.items()}

    def chunk_runs(self, chunk: int) -> range:
        """The runs of one chunk."""
        return range(chunk * self.chunk_size, min((chunk + 1) * self.chunk_size, len(self)))

    @property
    def chunks(self) -> range:
        """The numbers of the chunks."""
        return range(-(-len(self) // self.chunk_size))

    @property
    def varying_parameters(self) -> tuple[ScenarioParameter, ...]:
        """All numbers that are not the same in every run."""
        return (*self.parameters, *(number for number, _ in self.follow))

    def varying_values(self, runs: Sequence[int]) -> npt.NDArray[np.float64]:
        """The values of these numbers in some runs (R, d)."""
        values = self.values[runs]
        return np.hstack([values, values[:, [i for _, i in self.follow]]])

    def initial_states(self, runs: Sequence[int]) -> list[dict[str, float] | None]:
        """Where each of these runs begins, as `scenario` takes it; found for all at once."""
        return self.template.initial_states(self.varying_parameters, self.varying_values(runs))

    def scenario(self, run: int, rest: dict[str, float] | None = None) -> Scenario:
        """One of the runs. Raises ParameterError or PhysicsError where its values are not possible together."""
        return self.template.with_values(self.varying_parameters, self.varying_values([run])[0].tolist(), rest)

    def fingerprint(self) -> str:
        """The fingerprint of all that the results depend on, but for the program."""
        scenario = dataclasses.replace(self.template.scenario, title="")
        tables = {name: table for name, table in self.template.tables.items() if name != "title"}
        return fingerprint(scenario, tables, self.parameters, self.follow, self.metrics)


def column_units(scenario: Scenario) -> dict[str, str]:
    """The units of all columns that a run has."""
    return units_of_run(scenario.plant, scenario.start, scenario.command)


def load_study(path: str | Path) -> Study:
    """The study in a file. Raises FileError, ParameterError, UnitError or UnknownName, saying where."""
    file = Path(path)
    tables = parsed(file)
    place = Location(str(file), "", file.parent)
    check_keys(tables, TABLES, place)
    source = _read_scenario(tables.get("scenario"), place)
    varied = _require_table(tables, "vary", place)
    numbers = {key: source.parameter(key, str(place.inside("vary"))) for key in varied}
    variations = [_read_variation(varied[key], number, place) for key, number in numbers.items()]
    design: Design = chosen(tables.get("design"), DESIGNS, place.inside("design"))
    with located_errors(place.inside("design")):
        values = design.values(variations)
    return Study(
        title=text(tables, "title", place, needed=False) or source.scenario.title,
        path=file,
        template=source,
        parameters=tuple(numbers.values()),
        variations=tuple(variations),
        follow=_read_follow(tables.get("follow", {}), source, list(numbers), place.inside("follow")),
        design=design,
        values=values,
        metrics=_read_metrics(_require_table(tables, "outcome", place), source.scenario, place.inside("outcome")),
        chunk_size=_read_chunk_size(tables.get("chunk", CHUNK_SIZE), f"{place}, chunk"),
    )


def _read_scenario(given: Any, place: Location) -> ScenarioTemplate:
    if isinstance(given, str):
        file = place.folder / given
        with located_errors(f"{place}, scenario"):
            return ScenarioTemplate(parsed(file), Location(str(file), "", file.parent), load_scenario(file))
    if not isinstance(given, Mapping):
        raise ParameterError(
            f'{place}: scenario is {given!r}; name a file, scenario = "fill.toml", or write the tables '
            "[scenario.plant], [scenario.command] and [scenario.run]."
        )
    return ScenarioTemplate(given, place.inside("scenario"), scenario_from(given, place.inside("scenario")))


def _require_table(tables: Mapping[str, Any], key: str, place: Location) -> Mapping[str, Any]:
    given = tables.get(key)
    if not isinstance(given, Mapping) or not given:
        what = "is missing" if given is None else "is empty" if given == {} else f"is {given!r}, no table"
        raise ParameterError(f"{place}: the table [{key}] {what}; a study needs at least one line under it.")
    return given


def _read_variation(given: Any, number: ScenarioParameter, place: Location) -> Variation:
    where = Location(f'{place}, [vary], "{number.path}"', "", place.folder)
    found = read_variation(given, number.unit, where)
    low, high = number.bounds
    unit = "" if number.unit == "1" else f" {number.unit}"
    beyond = [v for v in found.support if np.isfinite(v) and not low <= v <= high]
    if beyond:
        raise ParameterError(f"{where} goes to {beyond[0]:g}{unit}; allowed are {low:g} to {high:g}{unit}.")
    return found


def _read_follow(
    given: Any, source: ScenarioTemplate, varied: list[str], place: Location
) -> tuple[tuple[ScenarioParameter, int], ...]:
    if not isinstance(given, Mapping):
        raise ParameterError(f'{place} is {given!r}; write "path" = "path of a number that varies".')
    found = []
    for path, leader in given.items():
        number = source.parameter(path, str(place))
        if path in varied:
            raise ParameterError(f"{place}: '{path}' varies by itself; take it out of [vary] or of [follow].")
        if leader not in varied:
            near = suggestion(str(leader), varied)
            raise ParameterError(f"{place}: '{path}' follows {leader!r}, which is not under [vary].{near}")
        unit = source.parameter(leader, str(place)).unit
        if unit != number.unit:
            raise ParameterError(f"{place}: '{path}' [{number.unit}] cannot follow '{leader}' [{unit}].")
        found.append((number, varied.index(leader)))
    return tuple(found)


def _read_metrics(given: Mapping[str, Any], scenario: Scenario, place: Location) -> dict[str, Metric]:
    known = column_units(scenario)
    found: dict[str, Metric] = {}
    for name, table in given.items():
        column = table.get("column") if isinstance(table, Mapping) else None
        if isinstance(column, str) and column not in known:
            near = suggestion(column, known)
            raise ParameterError(
                f"{place.inside(name)}: a run has no column '{column}'; there are {', '.join(known)}.{near}"
            )
        outcome = chosen(table, METRICS, place.inside(name), known.get(str(column), "1") or "1")
        with located_errors(place.inside(name)):
            outcome.check_range(scenario.start_time, scenario.duration)
            if isinstance(outcome, TimeSeries):
                outcome = outcome.clip_to_run(scenario.start_time, scenario.duration)
        found[name] = outcome
    return found


def _read_chunk_size(given: Any, where: str) -> int:
    found: int = whole(given, "1", where)
    if not found:
        raise ParameterError(f"{where} is 0; at least one run is written at a time.")
    return found
