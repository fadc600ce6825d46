"""Study files: a scenario, its varied parameters, the design of experiments and the metrics;
docs/guides/study.md.
"""

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import ParameterError, ShortRepr, abridged, ambient_pressure, check_known, suggestion
from ...core.tree import fingerprint
from ...files.library import Location, TableReader, check_keys, located_errors, read_text, read_toml
from ...files.scenario.scenario import Scenario, build_scenario, load_scenario, run_column_units
from ...recording import Recording
from .design import DESIGNS, Design
from .distributions import Variation, read_variation
from .metrics import METRICS, Metric, Scalar, TimeSeries
from .paths import ScenarioParameter, ScenarioTemplate, read_count

TABLES = ("title", "scenario", "chunk_size", "vary", "follow", "design", "metrics")
CHUNK_SIZE = 32
"""Default number of runs that are saved together (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Study(ShortRepr):
    """A parameter study: many runs of one scenario.

    parameters  the d varied parameters
    variations  their distributions or level sets
    follow      further parameters, each with the index of the varied parameter whose value it takes
    design      the design of experiments
    values      the parameter values (N, d), one row per run
    metrics     the metrics kept from each run, by name
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
        """The scalar metrics by name."""
        return {name: metric for name, metric in self.metrics.items() if isinstance(metric, Scalar)}

    @property
    def time_series(self) -> dict[str, TimeSeries]:
        """The time series by name."""
        return {
            name: metric for name, metric in self.metrics.items() if isinstance(metric, TimeSeries)
        }

    @property
    def units(self) -> dict[str, str]:
        """The units of the metrics."""
        known = run_column_units(self.template.scenario.problem)
        return {name: metric.unit(known[metric.column]) for name, metric in self.metrics.items()}

    @property
    def metric_times(self) -> npt.NDArray[np.float64]:
        """All times [s] at which the metrics are evaluated, sorted."""
        return np.unique(np.concatenate([metric.times for metric in self.metrics.values()]))

    def scalar_values(self, recording: Recording) -> dict[str, float]:
        """The scalar metrics of a run."""
        time = recording["time"]
        return {
            name: metric.value(time, recording[metric.column])
            for name, metric in self.scalars.items()
        }

    @functools.cached_property
    def chunks(self) -> list[range]:
        """The runs of each chunk."""
        starts = range(0, len(self), self.chunk_size)
        return [range(start, min(start + self.chunk_size, len(self))) for start in starts]

    def varying(
        self, runs: Sequence[int]
    ) -> tuple[tuple[ScenarioParameter, ...], npt.NDArray[np.float64]]:
        """The D varied parameters and those that follow them, and their values (R, D) in R runs."""
        values = self.values[runs]
        followers = [parameter for parameter, _ in self.follow]
        return (*self.parameters, *followers), np.hstack(
            [values, values[:, [i for _, i in self.follow]]]
        )

    def scenario(self, run: int, initial_state: dict[str, float] | None = None) -> Scenario:
        """The scenario of one run. Raises ParameterError or PhysicsError if its parameter values
        are not valid.
        """
        parameters, values = self.varying([run])
        return self.template.with_values(parameters, values[0].tolist(), initial_state)

    def fingerprint(self) -> str:
        """The fingerprint of everything that the results depend on, except for the program."""
        scenario = dataclasses.replace(self.template.scenario, title="")
        tables = {name: table for name, table in self.template.tables.items() if name != "title"}
        return fingerprint(scenario, tables, self.parameters, self.follow, self.metrics)


def load_study(path: str | Path) -> Study:
    """Read a study file. Raises FileError, ParameterError, UnitError or UnknownNameError with the
    location.
    """
    file = Path(path)
    tables = read_toml(file)
    location = Location.of_file(file)
    check_keys(tables, TABLES, location)
    template = _read_scenario(tables.get("scenario"), location)
    with ambient_pressure(template.scenario.plant.ambient.pressure):  # that of the texts
        vary = _require_table(tables, "vary", location)
        parameters = {name: template.parameter(name, str(location.inside("vary"))) for name in vary}
        variations = []
        for name, parameter in parameters.items():
            entry = Location(f'{location}, [vary], "{name}"', "", location.folder)
            low, high = parameter.bounds
            variations.append(read_variation(vary[name], parameter.unit, entry))
            if outside := [
                v for v in variations[-1].support if np.isfinite(v) and not low <= v <= high
            ]:
                unit = "" if parameter.unit == "1" else f" {parameter.unit}"
                allowed = f"{low:g} to {high:g}{unit}"
                raise ParameterError(
                    f"{entry} includes {outside[0]:g}{unit}; allowed range: {allowed}."
                )
        inside = location.inside("design")
        table = _require_table(tables, "design", location)
        design: Design = TableReader(classes=DESIGNS).build(table, inside)
        with located_errors(inside):
            values = design.values(variations)
        metrics = _require_table(tables, "metrics", location)
        chunk_size = read_count(
            tables.get("chunk_size", CHUNK_SIZE), "1", f"{location}, chunk_size"
        )
        if not chunk_size:
            raise ParameterError(f"{location}, chunk_size is 0; it must be at least 1.")
        return Study(
            title=read_text(tables, "title", location, needed=False) or template.scenario.title,
            path=file,
            template=template,
            parameters=tuple(parameters.values()),
            variations=tuple(variations),
            follow=_read_follow(
                tables.get("follow", {}), template, list(parameters), location.inside("follow")
            ),
            design=design,
            values=values,
            metrics=_read_metrics(metrics, template.scenario, location.inside("metrics")),
            chunk_size=chunk_size,
        )


def _read_scenario(value: Any, location: Location) -> ScenarioTemplate:
    if isinstance(value, str):
        file = location.folder / value
        with located_errors(f"{location}, scenario"):
            return ScenarioTemplate(read_toml(file), Location.of_file(file), load_scenario(file))
    if not isinstance(value, Mapping):
        raise ParameterError(
            f'{location}: scenario is {abridged(value)}; name a file, scenario = "fill.toml", or'
            " write the tables [scenario.plant], [scenario.input] and [scenario.run]."
        )
    return ScenarioTemplate(
        value, location.inside("scenario"), build_scenario(value, location.inside("scenario"))
    )


_EXAMPLES = {
    "vary": '"mechanism.mass" = ["5 kg", "10 kg"]',
    "design": 'model = "Grid"',
    "metrics": 'highest = { model = "Maximum", column = "position" }',
}
"""An entry of each table that a study needs."""


def _require_table(tables: Mapping[str, Any], key: str, location: Location) -> Mapping[str, Any]:
    table = tables.get(key)
    if not isinstance(table, Mapping) or not table:
        problem = (
            "is missing"
            if table is None
            else "is empty"
            if table == {}
            else f"is {abridged(table)}, not a table"
        )
        raise ParameterError(
            f"{location}: [{key}] {problem}; it must contain an entry, such as {_EXAMPLES[key]}."
        )
    return table


def _read_follow(
    table: Any, template: ScenarioTemplate, varied: list[str], location: Location
) -> tuple[tuple[ScenarioParameter, int], ...]:
    if not isinstance(table, Mapping):
        raise ParameterError(
            f'{location} is {abridged(table)}; write "path" = "path of a varied parameter".'
        )
    followers = []
    for path, leader in table.items():
        parameter = template.parameter(path, str(location))
        if path in varied:
            raise ParameterError(
                f"{location}: '{path}' is also under [vary]; remove it from [vary] or from"
                " [follow]."
            )
        if leader not in varied:
            near = suggestion(str(leader), varied)
            raise ParameterError(
                f"{location}: '{path}' follows {abridged(leader)}, which is not under [vary].{near}"
            )
        unit = template.parameter(leader, str(location)).unit
        if unit != parameter.unit:
            raise ParameterError(
                f"{location}: '{path}' [{parameter.unit}] cannot follow '{leader}' [{unit}]; their"
                " units must be equal."
            )
        followers.append((parameter, varied.index(leader)))
    return tuple(followers)


def _read_metrics(
    tables: Mapping[str, Any], scenario: Scenario, location: Location
) -> dict[str, Metric]:
    known = run_column_units(scenario.problem)
    metrics: dict[str, Metric] = {}
    for name, table in tables.items():
        inner = location.inside(name)
        column = table.get("column") if isinstance(table, Mapping) else None
        if isinstance(column, str):
            check_known(f"{inner}: a run has no column", column, known, "its columns are")
        metric = TableReader(classes=METRICS, known=known.get(str(column), "1") or "1").build(
            table, inner
        )
        with located_errors(inner):
            metrics[name] = metric.clip_to_run(
                scenario.problem.start_time, scenario.problem.duration
            )
    return metrics
