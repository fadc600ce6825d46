"""Functional Mock-up Units: a system as an FMU of FMI 2.0 or 3.0, for Model Exchange and Co-Simulation."""

from __future__ import annotations

import dataclasses
import hashlib
import html
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...core.atomic_output import atomic_folder
from ...core.errors import ParameterError
from ...engine.compile.functions import Printer
from ...engine.compile.jacobians import EventIndicators, Partials, event_indicators, partials
from ...engine.run import Problem
from ...engine.run.integrators import Rodas4
from ...physics.plant.diagnostics import column_limits, describe_limit
from ...physics.plant.plant import Plant
from .c_source import CSource
from .c_text import c_array, c_number, c_string, c_strings
from .fmi_description import FmuDescription
from .fmi_units import has_unit
from .fmi_variables import first_inputs, make_variables
from .platforms import Platform, this_platform
from .printed_system import acting_parameters
from .provenance import block_comment
from .targets import ExportedRun
from .templates import filled, template
from .write import make_run

VERSIONS = (2, 3)
HEADERS = {
    2: ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h"),
    3: ("fmi3FunctionTypes.h", "fmi3Functions.h", "fmi3PlatformTypes.h"),
}
"""Headers of the standard by version, with its 2-clause BSD licence in each."""
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{0}</title></head>
<body><pre>{1}</pre></body></html>
"""
"""The documentation of an FMU."""
SLACK = 1e-10
"""Distance of an event from the change of sign of its indicator, relative to the scale of the indicator; chosen."""
NOTE = (
    "The FMU contains the equations of the plant and its integrator. Its log states where a run leaves the validity "
    "range of a characteristic, the range of the data of a friction, the contraction range of a geometry, or the range "
    "of an input; the ranges are those of the exported parameters. Remarks of valves and tubes on their own validity "
    "are not in it."
)


@dataclasses.dataclass(frozen=True)
class WrittenFmu:
    """An FMU that has been written.

    platforms  the folders of its binaries, such as `linux64`; none for an FMU that contains sources only
    remark     why there is no binary; empty if there is one
    """

    path: Path
    platforms: tuple[str, ...]
    remark: str


def write_fmu(
    problem: Problem, path: str | Path, *, fmi: int = 3, name: str = "", title: str = "",
    tunable: Sequence[str] | None = None, binary: bool = True, platforms: Sequence[Platform] = (),
) -> WrittenFmu:  # fmt: skip
    """Write a system as an FMU, with its sources and a binary for this machine.

    problem  a system with its initial state, the inputs at its start, and the integrator of Co-Simulation
    fmi      version of the standard, 2 or 3
    name     identifier of the model; by default the title
    tunable  paths of the parameters that are variables of the FMU; the others become constants. By default all that act
             on the run, which validity ranges and ratings do not
    binary   False: sources only. Without a C compiler the FMU contains sources only, which `remark` states
    platforms  instead of this machine, platforms for which zig compiles the binaries; it needs the package ziglang

    The FMU contains no Python. The same arguments and version give the same file on one machine and compiler. Raises
    ParameterError for what cannot be exported, which it names, and FileError.
    """
    if fmi not in VERSIONS:
        raise ParameterError(f"write_fmu: FMI {fmi} is not supported; allowed: 2 or 3.")
    target = Path(path)
    if target.suffix != ".fmu":
        raise ParameterError(f"write_fmu: '{target.name[:80]}' must end in .fmu, as importers expect.")
    chosen = acting_parameters(problem.compiled) if tunable is None else tunable
    program = make_run(problem, name=name, title=title, tunable=chosen, notes=[NOTE])
    files = fmu_files(program, fmi)
    folders, remark = list[str](), "none was requested"
    if binary:
        folders, libraries, remark = _binaries(program.name, fmi, files, platforms)
        files |= libraries
    with atomic_folder(target.parent) as staging:
        (staging / target.name).write_bytes(_archive(files))
    return WrittenFmu(target, tuple(folders), remark)


def fmu_files(program: ExportedRun, fmi: int) -> dict[str, bytes]:
    """The files of an FMU without its binary, by their paths in it."""
    derivatives, indicators = partials(program.system.traced), event_indicators(program.system.traced)

    def extend(printer: Printer) -> None:
        derivatives.extend(printer)
        indicators.extend(printer)

    source = CSource(program.name, program.system, program.run.integrator, program.provenance, extend).files()
    variables = make_variables(program.system, program.run, indicators.count if fmi == 3 else 0)
    content = json.dumps([*source.values(), *map(repr, variables), fmi]).encode()
    token = f"{{{hashlib.sha256(content).hexdigest()[:32]}}}"
    title = program.provenance[0]
    about = FmuDescription(
        program.name,
        title,
        token,
        program.system,
        program.run,
        variables,
        derivatives.places,
        indicators.count,
    )
    places = {"provenance": block_comment(program.provenance), "file": program.name}
    if fmi == 3:
        places["adjoint"] = filled("adjoint.h", {}, program.name)
    texts = {
        **source,
        f"{program.name}_instance.h": filled(
            "instance.h", _instance(program, derivatives, indicators, token), program.name
        ),
        f"fmi{fmi}.c": filled(f"fmi{fmi}.c", places, program.name),
        **{file: template(f"fmi/{file}") for file in HEADERS[fmi]},
    }
    if fmi == 3:
        texts["fmi3_absent.h"] = filled("fmi3_absent.h", {}, program.name)
        texts["buildDescription.xml"] = _build_description(program.name)
    page = PAGE.format(html.escape(title), html.escape("\n".join(program.provenance)))
    files = {"modelDescription.xml": about.text(fmi), "documentation/index.html": page}
    files |= {f"sources/{file}": text for file, text in texts.items()}
    return {file: text.encode("utf-8", "replace") for file, text in files.items()}


def _build_description(name: str) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'  <BuildConfiguration modelIdentifier="{name}">\n    <SourceFileSet language="C99">\n'
        f'      <SourceFile name="fmi3.c"/>\n      <SourceFile name="{name}.c"/>\n    </SourceFileSet>\n'
        "  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )


def _instance(
    program: ExportedRun, derivatives: Partials, indicators: EventIndicators, token: str
) -> Mapping[str, str]:
    """The places of the template of an instance."""
    system, run, name = program.system, program.run, program.name
    known, limits = system.compiled.description, _limits(system.compiled.system, system.columns)
    lowest = [*known.lower_bounds.tolist(), *(-float("inf") for _ in system.input_names)]
    positive = set(known.positive_outputs.tolist())
    lowest += [5e-324 if i in positive else -float("inf") for i in range(len(system.output_names))]
    rows = "".join(
        f"  {{{column}, {c_number(low)}, {c_number(high)}, {c_string(text)}}},\n" for column, low, high, text in limits
    )
    upper, bounds = name.upper(), [leaf.declared.bounds for leaf in system.tunable]
    scales = indicators.scales(run.initial, run.segments.values[0], system.defaults, system.nominal)
    constants = [
        c_strings(f"static const char *const {name}_names[]", system.columns),
        c_array(f"static const double {name}_minimum[]", lowest),
        c_array(f"static const double {name}_start_states[{upper}_STATES]", run.initial),
        c_array(f"static const double {name}_start_inputs[{upper}_INPUTS + 1]", first_inputs(run), 1),
        c_array(f"static const double {name}_lowest[{upper}_PARAMETERS + 1]", [low for low, _ in bounds], 1),
        c_array(f"static const double {name}_highest[{upper}_PARAMETERS + 1]", [high for _, high in bounds], 1),
        c_array(f"static const double {name}_scales[{upper}_INDICATORS + 1]", scales, 1),
        _indices(f"{name}_rows", [row for row, _ in derivatives.places]),
        _indices(f"{name}_columns", [column for _, column in derivatives.places]),
        "/* Ranges that are reported once when a column leaves them. */\n"
        f"static const struct {{\n  int column;\n  double low, high;\n  const char *text;\n}} {name}_limits[] = {{\n"
        f'{rows}  {{0, 0.0, 0.0, ""}}\n}};\n',
    ]
    rtol = run.integrator.rtol if isinstance(run.integrator, Rodas4) else 0.0
    return {
        "file": name, "token": token, "partials": str(len(derivatives.places)), "limits": str(len(limits)),
        "indicators": str(indicators.count), "slack": c_number(SLACK),
        "rtol": c_number(rtol), "start": c_number(run.start), "constants": "".join(constants),
    }  # fmt: skip


def _indices(name: str, values: Sequence[int]) -> str:
    return f"static const int {name}[] = {{{', '.join(map(str, [*values, 0]))}}};\n"


def _limits(system: object, columns: Sequence[str]) -> list[tuple[int, float, float, str]]:
    """The ranges of columns: number of the column, lowest and highest value, text."""
    limits: list[tuple[int, float, float, str]] = []
    plant = getattr(system, "plant", system)
    if isinstance(plant, Plant):
        for limit in column_limits(plant.muscles, plant.prefixes):
            if limit.column in columns:
                low, high = limit.bounds
                slack = 1e-9 * max(abs(x) for x in (low, high) if abs(x) < float("inf"))
                limits.append((columns.index(limit.column), low - slack, high + slack, describe_limit(limit)))
    for given in getattr(system, "input_variables", ()):
        slack = 1e-9 * (given.maximum - given.minimum)
        unit = f" {given.unit}" if has_unit(given.unit) else ""
        text = f"the input {given.name} is outside its range, {given.minimum:.4g} to {given.maximum:.4g}{unit}"
        limits.append((columns.index(given.name), given.minimum - slack, given.maximum + slack, text))
    return limits


def _binaries(
    name: str, fmi: int, files: Mapping[str, bytes], platforms: Sequence[Platform]
) -> tuple[list[str], dict[str, bytes], str]:
    """Folders and files of the binaries; without platforms that of this machine, or none and the reason."""
    sources = {file.removeprefix("sources/"): text for file, text in files.items() if file.startswith("sources/")}
    units, folders, libraries = [f"fmi{fmi}.c", f"{name}.c"], list[str](), dict[str, bytes]()
    for target in platforms or [this_platform()]:
        try:
            library = target.compile(sources, units, name)
        except ParameterError as reason:
            if platforms:
                raise
            return [], {}, str(reason)
        folders.append(target.folder(fmi))
        libraries[f"binaries/{folders[-1]}/{name}{target.suffix}"] = library
    return folders, libraries, ""


def _archive(files: Mapping[str, bytes]) -> bytes:
    """A ZIP file of these files, with the description first; all times are those that ZIP begins with."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(files, key=lambda file: (file != "modelDescription.xml", file)):
            entry = zipfile.ZipInfo(file)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, files[file])
    return buffer.getvalue()
