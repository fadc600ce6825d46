"""Controllers as FMUs for Co-Simulation, and a control loop as an SSP package: FMUs of plant and
controller, joined.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from ...core import ParameterError
from ...engine.compile.text.languages import CLanguage
from ...engine.loop import MEASURED, SETPOINT, Schedule, named_signal_units
from ...engine.run import Problem, solve
from ...engine.run.sampled_loop import SampledLoop, prepare_loop
from ...recording.columns import column_units
from . import fmi_package
from .compiler import Platform
from .fmi_package import FmuPackage, WrittenFmu, archive, check_target, token_of
from .fmi_variables import Variable, Variables, base_powers, has_unit
from .fmu import fmu_package
from .identifiers import block_comment, c_number, c_values, filled, program_name
from .printed_controller import PrintedController
from .printed_predictive import check_control_law, print_any_controller, with_printable_controller

STRUCTURE, COMMON, VALUES = (
    f"http://ssp-standard.org/SSP1/SystemStructure{kind}"
    for kind in ("Description", "Common", "ParameterValues")
)
"""Namespaces of SSP 1.0."""
FMU_TYPE = "application/x-fmu-sharedlibrary"


def write_controller_fmu(
    problem: Problem,
    path: str | Path,
    *,
    fmi: int = 3,
    name: str = "",
    title: str = "",
    binary: bool = True,
    platforms: Sequence[Platform] = (),
) -> WrittenFmu:
    """Write the control law of a problem as an FMU for Co-Simulation, without the plant.

    problem  a plant with a ControlLoop, whose sample time, ranges and set points at its start are
             those of the FMU; drivers between commands and openings are not in the FMU, which its
             documentation states

    Inputs are the measured columns and `setpoint.NAME`, outputs the commands; all parameters of the
    law are tunable. At a sampling instant the commands follow from the inputs at once; the step
    that begins there holds them. Other arguments and errors are those of `write_fmu`.
    """
    target = check_target(path, fmi)
    package = controller_package(problem, fmi, name, title)
    return fmi_package.write_archive(target, *package.content(fmi, binary, platforms))


def controller_package(problem: Problem, fmi: int, name: str = "", title: str = "") -> FmuPackage:
    """The FMU of the control law of a problem, without its binary."""
    problem = with_printable_controller(problem)
    loop = check_control_law(problem)
    prepared = prepare_loop(problem, loop.init(problem.start_time))
    chosen = program_name(name, title or type(loop.controller).__name__)
    printed = print_any_controller(prepared, chosen, title, None)
    variables = _variables(problem, printed, prepared)
    start = [float(v.start or 0.0) for v in variables if v.causality == "input"]
    token = token_of(*variables, *printed.source_files().values(), fmi)
    outputs = [v.reference for v in variables if v.causality == "output"]
    known = [v.reference for v in variables if v.causality == "input"]
    experiment = {"startTime": problem.start_time, "stopTime": float(prepared.instants[-1])}
    experiment["stepSize"] = loop.sample_time
    places = printed.places | {
        "provenance": block_comment(printed.provenance),
        "token": token,
        "period": c_number(loop.sample_time),
        "start": c_number(problem.start_time),
        "start_inputs": c_values(start, 1),
        "functions": printed.sample_in(CLanguage("double", f"{chosen}_")),
    }
    sources = {f"{chosen}_instance.h": filled("controller_instance.h", places, chosen)}
    return FmuPackage(
        chosen,
        printed.provenance,
        token,
        variables,
        dict.fromkeys(outputs, known),
        0,
        experiment,
        sources,
        has_states=False,
    )


def _variables(
    problem: Problem, printed: PrintedController, prepared: SampledLoop
) -> list[Variable]:
    """Time, measurements, set points, commands and parameters, in the order of the template
    `controller_instance.h`.
    """
    law = printed.law
    first = _first_row(problem)
    variables = Variables()
    of_columns = column_units(problem.system, problem.compiled.description.output_names)
    units = {**named_signal_units(law), **{name: unit for name, unit in of_columns.items() if unit}}
    for column in law.measured_columns:
        start = first[f"{MEASURED}{column}"]
        unit = units.get(column, "")
        variables.add(column, "input", f"{column}, measured", start=start, unit=unit)
    for signal, value in zip(law.setpoints, prepared.setpoint_values[0].tolist(), strict=True):
        variables.add(
            f"{SETPOINT}{signal}",
            "input",
            f"{signal} wanted",
            start=value,
            unit=units.get(signal, ""),
        )
    for command, (low, high) in zip(law.inputs, printed.ranges, strict=True):
        about = f"command of {command}, held for {prepared.loop.sample_time:g} s"
        facts = {"minimum": low, "maximum": high, "unit": units.get(command, "")}
        variables.add(
            command, "output", about, variability="discrete", initial="calculated", **facts
        )
    variables.add_parameters(printed.tunable)
    return variables.checked()


def _first_row(problem: Problem) -> dict[str, float]:
    """All columns at the first sample of a loop."""
    loop = check_control_law(problem)
    short = dataclasses.replace(
        problem, duration=min(problem.duration, loop.sample_time), output_times=None
    )
    recording = solve(short).raise_if_incomplete().recording
    return {name: float(recording[name][0]) for name in recording}


def write_ssp(
    problem: Problem,
    path: str | Path,
    *,
    fmi: int = 2,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] | None = None,
    binary: bool = True,
    platforms: Sequence[Platform] = (),
) -> WrittenFmu:
    """Write a plant with its control loop as an SSP 1.0 package: two FMUs, and how they are joined.

    The inputs of the package are the set points and the inputs of the plant that the loop does not
    command; their start values, and those of all signals between the FMUs, are those of the problem
    at its start, so that a master that exchanges them after a step begins right. The FMUs are of
    FMI 2.0 by default, which the masters know. Raises ParameterError for a loop with drivers, which
    would stand between the FMUs;
    other arguments and errors are those of `write_fmu`.
    """
    target = check_target(path, fmi, ".ssp")
    problem = with_printable_controller(problem)
    loop = check_control_law(problem)
    if loop.drivers:
        raise ParameterError(
            "an SSP package joins plant and controller directly; there are drivers of"
            f" {', '.join(loop.drivers)}. Leave drivers out, or export the loop to C, JavaScript or"
            " Octave, which have them."
        )
    base = program_name(name, title or type(problem.system).__name__)
    first = _first_row(problem)
    inputs = {
        n: ((problem.start_time, first[n]),) for n in problem.compiled.description.input_names
    }
    open_loop = dataclasses.replace(problem, input=Schedule(inputs), control_state=None)
    packages = {
        "plant": fmu_package(open_loop, fmi, f"{base}_plant", title, tunable),
        "controller": controller_package(problem, fmi, f"{base}_controller", title),
    }
    files = dict[str, bytes]()
    folders = list[str]()
    remark = ""
    for part, package in packages.items():
        files[f"resources/{part}.fmu"], folders, remark = package.content(fmi, binary, platforms)
    files["SystemStructure.ssd"] = _structure(base, packages).encode()
    return fmi_package.write_archive(target, archive(files, "SystemStructure.ssd"), folders, remark)


def _structure(name: str, parts: dict[str, FmuPackage]) -> str:
    """The file SystemStructure.ssd of a plant and a controller."""
    names = {"xmlns:ssd": STRUCTURE, "xmlns:ssc": COMMON, "xmlns:ssv": VALUES}
    described = {**names, "version": "1.0", "name": name}
    root = Element("ssd:SystemStructureDescription", described)
    system = SubElement(root, "ssd:System", name=name)
    inside = {
        part: {v.name: v for v in package.variables if v.causality in ("input", "output")}
        for part, package in parts.items()
    }
    joined = _joined_ports(inside)
    outside = _free_inputs(inside, {(target, signal) for _, signal, target in joined})
    _connectors(system, [v for _, v in outside])
    elements = SubElement(system, "ssd:Elements")
    for part, ports in inside.items():
        component = SubElement(
            elements, "ssd:Component", name=part, type=FMU_TYPE, source=f"resources/{part}.fmu"
        )
        _connectors(component, list(ports.values()))
        _start_values(component, [v for v in ports.values() if v.causality == "input"])
    connections = SubElement(system, "ssd:Connections")
    for part, v in outside:
        SubElement(
            connections,
            "ssd:Connection",
            startConnector=v.name,
            endElement=part,
            endConnector=v.name,
        )
    for a, signal, b in joined:
        ends = {
            "startElement": a,
            "startConnector": signal,
            "endElement": b,
            "endConnector": signal,
        }
        SubElement(connections, "ssd:Connection", ends)
    units = SubElement(root, "ssd:Units")
    for unit in sorted(
        {v.unit for ports in inside.values() for v in ports.values() if has_unit(v.unit)}
    ):
        powers = {base: str(power) for base, power in (base_powers(unit) or {}).items()}
        SubElement(SubElement(units, "ssc:Unit", name=unit), "ssc:BaseUnit", powers)
    experiment = parts["controller"].experiment
    SubElement(
        root,
        "ssd:DefaultExperiment",
        {key: repr(experiment[key]) for key in ("startTime", "stopTime")},
    )
    return fmi_package.xml_text(root)


def _start_values(component: Element, variables: Sequence[Variable]) -> None:
    """The start values of the inputs of a component, as parameters that its master sets."""
    bindings = SubElement(component, "ssd:ParameterBindings")
    values = SubElement(SubElement(bindings, "ssd:ParameterBinding"), "ssd:ParameterValues")
    parameter_set = SubElement(values, "ssv:ParameterSet", version="1.0", name="start")
    parameters = SubElement(parameter_set, "ssv:Parameters")
    for v in variables:
        parameter = SubElement(parameters, "ssv:Parameter", name=v.name)
        SubElement(parameter, "ssv:Real", value=repr(float(v.start or 0.0)))


def _joined_ports(inside: Mapping[str, Mapping[str, Variable]]) -> list[tuple[str, str, str]]:
    """Part, signal and other part of the outputs of plant and controller that are inputs of the
    other.
    """
    joined = []
    for source, target in (("plant", "controller"), ("controller", "plant")):
        inputs = {name for name, v in inside[target].items() if v.causality == "input"}
        for signal, v in inside[source].items():
            if v.causality == "output" and signal in inputs:
                joined.append((source, signal, target))
    return joined


def _free_inputs(
    inside: Mapping[str, Mapping[str, Variable]], joined: set[tuple[str, str]]
) -> list[tuple[str, Variable]]:
    """Part and variable of the inputs that no output is connected to."""
    return [
        (part, v)
        for part, ports in inside.items()
        for v in ports.values()
        if v.causality == "input" and (part, v.name) not in joined
    ]


def _connectors(parent: Element, variables: Sequence[Variable]) -> None:
    connectors = SubElement(parent, "ssd:Connectors")
    for v in variables:
        connector = SubElement(connectors, "ssd:Connector", name=v.name, kind=v.causality)
        SubElement(connector, "ssc:Real", {"unit": v.unit} if has_unit(v.unit) else {})
