"""Functional Mock-up Units: a system as an FMU of FMI 2.0 or 3.0, for Model Exchange and
Co-Simulation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...engine.compile.function import EventIndicators, Partials, event_indicators, partials
from ...engine.compile.functions import Printer
from ...engine.run import Problem, solve
from ...physics.plant.diagnostics import describe_limit
from ...physics.plant.plant import Plant
from .c_source import c_files, csv_text
from .compiler import Platform
from .exported_run import ExportedRun
from .fmi_package import FmuPackage, WrittenFmu, check_target, token_of, write_archive
from .fmi_variables import has_unit, make_variables, references_of
from .identifiers import c_number, c_string, c_strings, c_values, filled
from .printed_system import acting_parameters
from .write import make_run

SLACK = 1e-10
"""Distance of an event from the change of sign of its indicator, relative to the scale of the
indicator; chosen.
"""
NOTE = (
    "The FMU contains the equations of the plant and its integrator. Its log states where a run"
    " leaves the validity range of a characteristic, the range of the data of a friction, the"
    " contraction range of a geometry, or the range of an input; the ranges are those of the"
    " exported parameters. Remarks of valves and tubes on their own validity are not in it."
)


def write_fmu(
    problem: Problem,
    path: str | Path,
    *,
    fmi: int = 3,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] | None = None,
    binary: bool = True,
    platforms: Sequence[Platform] = (),
) -> WrittenFmu:
    """Write a system as an FMU, with its sources and a binary for this machine.

    problem  a system with its initial state, the inputs at its start, and the integrator of
             Co-Simulation
    fmi      version of the standard, 2 or 3
    name     identifier of the model; by default the title
    tunable  paths of the parameters that are variables of the FMU; the others become constants. By
             default all that act on the run, which validity ranges and ratings do not
    binary   False: sources only. Without a C compiler the FMU contains sources only, which `remark`
             states
    platforms  instead of this machine, platforms for which zig compiles the binaries; it needs the
               package ziglang

    The FMU contains no Python. It states terminals (FMI 3.0) and, as the layered standard
    FMI-LS-REF describes them, the inputs of the problem and its run by the library as reference
    results. A pressure `start.pressure` that is set before the end of the initialization gives the
    air mass of its muscle. The same arguments and version give the same file on one machine and
    compiler. Raises ParameterError for what cannot be exported, which it names, and FileError.
    """
    target = check_target(path, fmi)
    package = replace(fmu_package(problem, fmi, name, title, tunable), related=_reference(problem))
    return write_archive(target, *package.content(fmi, binary, platforms))


def _reference(problem: Problem) -> dict[str, str]:
    """The inputs of a problem and its run by the library, as CSV by the names of their files; none
    of a run that ends early."""
    solution = solve(problem)
    if solution.recording["time"][-1] < problem.end_time:
        return {}
    recording = solution.recording
    signals = problem.segments
    names = problem.compiled.description.input_names
    begins = [problem.start_time, *signals.ends[:-1].tolist()]
    ends = np.minimum(signals.ends, problem.end_time).tolist()
    rows = [
        (time, *(values + slopes * (time - begin))[: len(names)].tolist())
        for begin, end, values, slopes in zip(
            begins, ends, signals.values, signals.slopes, strict=True
        )
        for time in (begin, end)
    ]
    results = [name for name in recording if name != "time" and name not in names]
    columns = np.column_stack([recording[name] for name in ("time", *results)])
    return {
        "inputs.csv": csv_text(["time", *names], rows),
        "results.csv": csv_text(["time", *results], columns.tolist()),
    }


def fmu_package(
    problem: Problem,
    fmi: int,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] | None = None,
) -> FmuPackage:
    """The FMU of a problem without its binary; arguments as for `write_fmu`."""
    chosen = acting_parameters(problem.compiled) if tunable is None else tunable
    program = make_run(problem, name=name, title=title, tunable=chosen, notes=[NOTE])
    derivatives, indicators = (
        partials(program.system.traced),
        event_indicators(program.system.traced),
    )

    def extend(printer: Printer) -> None:
        derivatives.extend(printer)
        indicators.extend(printer)

    source = c_files(program.name, program.system, program.integrator, program.provenance, extend)
    starts = _start_pressures(program, derivatives)
    variables = make_variables(
        program,
        indicators.count if fmi == 3 else 0,
        {column: pressure for column, (pressure, *_) in starts.items()},
    )
    token = token_of(*source.values(), *variables, fmi)
    names = program.system.known.state_names
    dependencies: dict[int, list[int]] = {i: [i] for i in range(1, len(names) + 1)}
    for place in derivatives.places:
        unknown, known = references_of(program.system.known, place)
        dependencies.setdefault(unknown, []).append(known)
    experiment = {"startTime": problem.start_time, "stopTime": float(program.times[-1])}
    experiment["tolerance"] = program.tolerance or 1e-6
    instance = filled(
        "instance.h", _instance(program, derivatives, indicators, token, starts), program.name
    )
    return FmuPackage(
        program.name,
        program.provenance,
        token,
        variables,
        dependencies,
        indicators.count,
        experiment,
        {**source, f"{program.name}_instance.h": instance},
    )


StartPressures = dict[str, tuple[float, int, int]]
"""The pressures of muscles [Pa] at the start by their columns, with their rows among rates and
outputs, and the states of the masses of their air."""


def _start_pressures(program: ExportedRun, derivatives: Partials) -> StartPressures:
    """The pressures of the muscles that follow from the mass of their air."""
    known = program.system.known
    system = program.system.compiled.system
    plant = getattr(system, "plant", system)
    states = known.state_names
    names = known.output_names
    state = dict(zip(states, program.problem.initial_vector.tolist(), strict=True))
    outputs = system.outputs(state, dict(zip(known.input_names, program.first_inputs, strict=True)))
    pressures: StartPressures = {}
    for prefix in plant.prefixes if isinstance(plant, Plant) else ():
        column = f"{prefix}pressure"
        mass = f"{prefix}air_mass"
        if column in names and mass in states:
            place = len(states) + names.index(column), states.index(mass)
            if place in derivatives.places:
                pressures[column] = float(outputs[column]), *place
    return pressures


def _instance(
    program: ExportedRun,
    derivatives: Partials,
    indicators: EventIndicators,
    token: str,
    starts: StartPressures,
) -> Mapping[str, str]:
    """The places of the template of an instance."""
    system = program.system
    known = program.system.known
    problem = program.problem
    name = program.name
    initial = problem.initial_vector
    inputs = program.first_inputs
    limits = _limits(system.compiled.system, known.column_names)
    least = np.full(len(known.output_names), -np.inf)
    least[known.positive_outputs] = 5e-324
    lowest = [*known.lower_bounds, *(-np.inf for _ in known.input_names), *least]
    ranges = "".join(
        f"  {{{column}, {c_number(low)}, {c_number(high)}, {c_string(text)}}},\n"
        for column, low, high, text in limits
    )
    scales = indicators.scales(initial, np.array(inputs), system.defaults, system.compiled.nominal)
    indices = {
        "rows": [row for row, _ in derivatives.places],
        "columns": [column for _, column in derivatives.places],
        "pressure_rows": [row for _, row, _ in starts.values()],
        "air_masses": [m for *_, m in starts.values()],
    }
    return {
        "file": name,
        "token": token,
        "partials": str(len(derivatives.places)),
        "limits": str(len(limits)),
        "indicators": str(indicators.count),
        "pressures": str(len(starts)),
        "slack": c_number(SLACK),
        "rtol": c_number(program.tolerance or 0.0),
        "start": c_number(problem.start_time),
        "ranges": ranges,
        "names": c_strings(known.column_names),
        "minimum": c_values(lowest),
        "start_states": c_values(initial),
        "start_inputs": c_values(inputs, 1),
        "scales": c_values(scales, 1),
        **{key: ", ".join(map(str, [*at, 0])) for key, at in indices.items()},
        "start_pressures": c_values([pressure for pressure, *_ in starts.values()], 1),
    }


def _limits(system: object, columns: Sequence[str]) -> list[tuple[int, float, float, str]]:
    """The ranges of columns: number of the column, lowest and highest value, text."""
    limits: list[tuple[int, float, float, str]] = []
    plant = getattr(system, "plant", system)
    if isinstance(plant, Plant):
        for limit in plant.column_limits:
            if limit.column in columns:
                low, high = limit.bounds
                slack = 1e-9 * max(abs(x) for x in (low, high) if abs(x) < float("inf"))
                limits.append(
                    (columns.index(limit.column), low - slack, high + slack, describe_limit(limit))
                )
    for variable in getattr(system, "input_variables", ()):
        slack = 1e-9 * (variable.maximum - variable.minimum)
        unit = f" {variable.unit}" if has_unit(variable.unit) else ""
        text = (
            f"the input {variable.name} is limited to its range, {variable.minimum:.4g} to"
            f" {variable.maximum:.4g}{unit}"
        )
        limits.append(
            (columns.index(variable.name), variable.minimum - slack, variable.maximum + slack, text)
        )
    return limits
