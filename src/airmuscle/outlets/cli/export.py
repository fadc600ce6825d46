"""`airmuscle export`: a scenario or a law as a program in another language."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from ...core import check_writable
from ...engine.run.batch.lanes import Precision
from ...files import list_plants
from ...files.library import load_law, read_toml
from ...files.scenario.scenario import Scenario, load_scenario
from .. import export as outlet
from ..export import PRECISIONS, OnnxStack, Stack, TorchStack, WarpStack
from ..export.compiler import PLATFORMS, PROCESSORS, Processor, build_and_run, find_platform
from ..export.identifiers import make_identifier
from ..export.robot_description import WRITERS
from ..export.targets import C99, JavaScript, Octave, Target
from ..requests.declaration import Where, check_rules, many, option, optional, request
from .options import Folder, Json, complete_entry
from .parser import Argument
from .requested import with_requests
from .terminal import echo, print_json

TARGETS: dict[str, Target] = {"c": C99(), "js": JavaScript(), "octave": Octave()}
"""Languages by the names of the option --to."""
STACKS: dict[str, Stack] = {"torch": TorchStack(), "warp": WarpStack(), "onnx": OnnxStack()}
"""Learning stacks by the names of the option --to."""
NAMES = (*TARGETS, "arduino", "fmu", "ssp", "mujoco", *WRITERS, "modelica", *STACKS)
"""All values of the option --to."""

SOURCE = "A scenario file or a plant of the library; with --law a library entry or a muscle file."
Source = Annotated[str, Argument("SOURCE", SOURCE, complete_entry)]


@request
class ExportRequest:
    """What an export is asked for."""

    to: str = option(f"Target: {', '.join(NAMES)}.", choices=NAMES, metavar="TARGET")
    name: str = option("Name of the program; default: that of the source.", default="")
    law: bool = option("Export only the static characteristic of a muscle.", default=False)
    controller: bool = option(
        "Export only the controller of a scenario: c, arduino, fmu.", default=False
    )
    build: bool = option(
        "Compile the C program with the compiler of this machine, and run it.", default=False
    )
    tunable: tuple[str, ...] = many(
        "A parameter that the program can change; repeatable. Default: all, of a controller none.",
        metavar="PATH",
    )
    fmi: int | None = optional(
        "Version of FMI: by default 3 for --to fmu, and 2 for ssp, which its masters know.",
        metavar="2|3",
    )
    sources_only: bool = option("An FMU without a binary; --to fmu, ssp.", default=False)
    platforms: tuple[str, ...] = many(
        "Binaries of an FMU for a platform, by the package ziglang; repeatable:"
        f" {', '.join(PLATFORMS)}. Default: this machine.",
    )
    muscle: str = option(
        "One muscle of the plant; --to mujoco, torch, warp, onnx. Without it the last three get a"
        " plant of several muscles as a whole.",
        default="",
    )
    precision: Precision = option(
        "Type of the numbers of a controller.",
        choices=PRECISIONS,
        default="double",
        metavar="double|float",
    )
    processor: Processor | None = optional(
        f"With --controller --build: run in the emulator QEMU as {' or '.join(PROCESSORS)}, not on"
        " this machine.",
        choices=PROCESSORS,
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for options that do not fit together."""
        law = self.law
        controller = self.controller
        to = self.to
        of_an_fmu = self.fmi is not None or self.sources_only or bool(self.platforms)
        check_rules(
            {
                "--controller: a controller is exported to C, and without --law; write --to c, --to arduino or --to fmu.": (  # noqa: E501
                    controller and (law or to not in ("c", "arduino", "fmu"))
                ),
                "--tunable: all parameters of a controller in an FMU can be changed; leave it out.": (  # noqa: E501
                    controller and to == "fmu" and self.tunable
                ),
                "--to arduino: an Arduino library contains a controller; add --controller.": (
                    to == "arduino" and not controller
                ),
                "--build: there is a program to compile with --to c and without --law.": (
                    self.build and (law or to != "c")
                ),
                f"--law: {to} contains a plant; leave --law out, or write --to c.": (
                    law and to not in TARGETS
                ),
                "--tunable: all parameters of an actuator can be changed; leave it out.": (
                    to in ("mujoco", *WRITERS) and self.tunable
                ),
                "--tunable: all parameters of a law can be changed; leave it out.": (
                    law and self.tunable
                ),
                "--fmi, --sources-only and --platforms belong to --to fmu and ssp.": (
                    of_an_fmu and to not in ("fmu", "ssp")
                ),
                "--precision belongs to --controller; plants are computed in double precision.": (
                    self.precision != PRECISIONS["double"] and not controller
                ),
                "--processor belongs to --controller --build.": (
                    self.processor and not (controller and self.build)
                ),
                "--sources-only and --platforms exclude each other.": (
                    self.sources_only and self.platforms
                ),
                f"--muscle belongs to --to mujoco, {', '.join(STACKS)}.": (
                    self.muscle and to not in ("mujoco", "fmu", "ssp", *STACKS)
                ),
            }
        )


@with_requests
def export(
    source: Source, request: ExportRequest, out: Folder = Path("export"), json: Json = False
) -> None:
    """Export to C, MATLAB, FMU, MuJoCo, PyTorch and other targets.

    \b
    The program contains the equations of the plant, the integrator, and a run of the scenario that
    writes CSV; in C, JavaScript and MATLAB also the controller and its drivers. Nothing of Python
    or airmuscle is needed to run it. Each file states version, hash of the model, parameters,
    references and licence; the same scenario gives the same files.

    \b
    Examples:
      airmuscle export examples/fill_discharge.toml --to c --out fill_c
      airmuscle export examples/fill_discharge.toml --to octave --tunable mechanism.mass --out
          fill_m
      airmuscle export dmsp-20-300 --law --to js --out law_js
      airmuscle export dmsp-20-300 --to torch --out actuator
      airmuscle export joint-dmsp-20-regulators --to torch --out arm
      airmuscle export joint-dmsp-20-matrix --to mjcf --out robot
      airmuscle export examples/pressure_loop.toml --to c --out loop_c
      airmuscle export examples/pressure_loop.toml --controller --to c --out controller
      airmuscle export examples/pressure_loop.toml --controller --to c --precision float --build
          --processor cortex-m4
      airmuscle export examples/pressure_loop.toml --controller --to arduino --precision float --out
          pressure_loop
      airmuscle export examples/fill_discharge.toml --to fmu --fmi 2 --out fill.fmu
      airmuscle export examples/pressure_loop.toml --controller --to fmu --out controller.fmu
      airmuscle export examples/joint_cascade.toml --to ssp --out loop.ssp
    """
    request = (
        request
        if request.name
        else dataclasses.replace(request, name=make_identifier(Path(source).stem))
    )
    if request.to not in ("fmu", "ssp"):
        check_writable(out)
    files, lines, more = WRITERS_BY_TARGET.get(request.to, _export_program)(source, out, request)
    if json:
        print_json({"files": [str(file) for file in files], **more})
    else:
        echo("\n".join([*(f"file: {file}" for file in files), *lines]))


class Exported(NamedTuple):
    """The files of an export, lines on their use, and what JSON states besides the files."""

    files: Sequence[Path]
    lines: Sequence[str] = ()
    more: Mapping[str, Any] = {}


def _export_fmu(source: str, out: Path, request: ExportRequest) -> Exported:
    """The FMU of a plant or of its controller, or both as an SSP package, in a folder or as a
    file.
    """
    platforms = [find_platform(platform) for platform in dict.fromkeys(request.platforms)]
    fmi = request.fmi or (2 if request.to == "ssp" else 3)
    part = "ssp" if request.to == "ssp" else "controller" if request.controller else "plant"
    suffix = ".ssp" if part == "ssp" else ".fmu"
    path = out if out.suffix == suffix else out / f"{request.name}{suffix}"
    check_writable(
        path.parent, shared=path.parent.exists()
    )  # several commands may write into one folder
    scenario = load_scenario(source)
    common: dict[str, Any] = {
        "fmi": fmi,
        "name": request.name,
        "title": scenario.title,
        "binary": not request.sources_only,
        "platforms": platforms,
    }
    if part == "controller":
        written = outlet.write_controller_fmu(scenario.problem, path, **common)
    else:
        write = outlet.write_ssp if part == "ssp" else outlet.write_fmu
        written = write(scenario.problem, path, tunable=request.tunable or None, **common)
    names = ", ".join(written.platforms)
    binaries = (
        f"with sources and a binary for {names}"
        if names
        else f"sources without a binary: {written.remark}"
    )
    uses = {
        "plant": f"run: fmpy simulate {path}",
        "controller": f"inputs: fmpy info {path}",
        "ssp": "open: SystemStructure.ssd joins plant and controller",
    }
    kinds = (
        f"FMI {fmi}.0, {'Model Exchange and ' if part == 'plant' else ''}Co-Simulation, {binaries}"
    )
    return Exported(
        [path],
        (kinds, uses[part]),
        {"platforms": list(written.platforms), "remark": written.remark},
    )


def _export_mujoco(source: str, out: Path, request: ExportRequest) -> Exported:
    """A MuJoCo plugin."""
    made = outlet.write_mujoco_plugin(
        load_scenario(source).plant, out, name=request.name, muscle=request.muscle
    )
    low, high = made.control_range
    size = f'actdim="{len(made.plant.states)}" dyntype="user" ctrlrange="{low:g} {high:g}"'
    lines = (
        f"plugin: {made.plugin_name}" + (f", source only: {made.remark}" if made.remark else ""),
        f'MJCF: <plugin plugin="{made.plugin_name}" tendon="NAME" {size}/>',
    )
    return Exported(made.files, lines, {"plugin": made.plugin_name, "remark": made.remark})


def _export_robot(source: str, out: Path, request: ExportRequest) -> Exported:
    """The robot description of a joint or an arm, with the plugins of its muscles."""
    write = WRITERS[request.to]
    written = write(load_scenario(source).plant, out, name=request.name)
    paths = [written.path]
    for plugin in written.plugins:
        paths += plugin.files
    remarks = list(dict.fromkeys(plugin.remark for plugin in written.plugins if plugin.remark))
    left_out = list(written.left_out)
    lines = [f"left out: {', '.join(left_out)}"] if left_out else []
    return Exported(paths, lines, {"remarks": remarks, "left_out": left_out})


def _export_actuator(source: str, out: Path, request: ExportRequest) -> Exported:
    """A plant of several muscles as a batched module, or the batched actuator of one muscle of a
    plant or of a muscle behind a pressure regulator.
    """
    file = Path(source)
    stack = STACKS[request.to]
    if source in list_plants() if not file.exists() else "plant" in read_toml(file):
        scenario = load_scenario(source)
        plant = scenario.plant
        if len(plant.muscles) > 1 and not request.muscle:
            return Exported(_written_plant(scenario, out, stack, request.name))
        return Exported(
            outlet.write_actuator(plant, out, stack, name=request.name, muscle=request.muscle)
        )
    entry = load_law(source)
    about: dict[str, Any] = {
        "name": request.name,
        "title": entry.title,
        "uncertainty": entry.uncertainty,
    }
    return Exported(
        outlet.write_actuator(outlet.regulated_plant(entry.muscle), out, stack, **about)
    )


def _written_plant(scenario: Scenario, out: Path, stack: Stack, name: str) -> Sequence[Path]:
    """The batched module of a whole plant, at pressures such as those at its start."""
    state = scenario.initial_state
    outputs = scenario.plant.outputs(state, dict.fromkeys(scenario.plant.inputs, 0.0))
    values = {**outputs, **state}
    pressures = [float(values[f"{prefix}pressure"]) for prefix in scenario.plant.prefixes]
    highest = max(pressures)
    return outlet.write_plant_module(
        scenario.plant,
        out,
        stack,
        name=name,
        title=scenario.title,
        pressure=highest if highest > 0.0 else None,
        uncertainty=scenario.uncertainty,
    )


def _export_modelica(source: str, out: Path, request: ExportRequest) -> Exported:
    """A Modelica package."""
    scenario = load_scenario(source)
    tunable = request.tunable or None
    paths = outlet.write_modelica(
        scenario.problem, out, name=request.name, title=scenario.title, tunable=tunable
    )
    return Exported(paths, (f'Modelica: loadFile("{paths[0]}"); block {request.name}.Plant',))


WRITERS_BY_TARGET: Mapping[str, Callable[[str, Path, ExportRequest], Exported]] = {
    **dict.fromkeys(("fmu", "ssp"), _export_fmu),
    "mujoco": _export_mujoco,
    "modelica": _export_modelica,
    **dict.fromkeys(WRITERS, _export_robot),
    **dict.fromkeys(STACKS, _export_actuator),
}
"""Writers of models for simulators and learning stacks; the other targets are programs."""


def _export_program(source: str, out: Path, request: ExportRequest) -> Exported:
    """A law, a controller, or a plant with its run, which is built and run if that is asked for."""
    if request.law:
        entry = load_law(source)
        target = TARGETS[request.to]
        paths = outlet.write_law(
            entry.characteristic, out, target, name=request.name, title=entry.title
        )
    else:
        scenario = load_scenario(source)
        common: dict[str, Any] = {"name": request.name, "title": scenario.title}
        if request.controller:
            common |= {"precision": request.precision, "arduino": request.to == "arduino"}
            paths = outlet.write_controller(
                scenario.problem, out, tunable=request.tunable, **common
            )
        else:
            common |= {"tunable": request.tunable or None, "columns": scenario.columns}
            paths = outlet.write_program(scenario.problem, out, TARGETS[request.to], **common)
    instruction = f"run: {_instruction(request.to, paths, request.law, request.controller)}"
    if not request.build:
        return Exported(paths, [instruction])
    built = build_and_run(paths, request.processor)
    text = built.output.strip()
    size = "unknown" if built.code_size is None else f"{built.code_size} bytes"
    if not request.controller:  # the output of a run is CSV
        text = f"{len(built.output.splitlines()) - 1} rows; {built.messages.strip()}"
    known = {} if built.stack_size is None else {"stack_bytes": built.stack_size}
    stack = f", stack {built.stack_size} bytes, both without the C library" if known else ""
    stated = {"output": built.output, "code_bytes": built.code_size, **known}
    return Exported(paths, [f"program: {text}; code {size}{stack}", instruction], stated)


def _instruction(to: str, paths: tuple[Path, ...], law: bool, controller: bool) -> str:
    """How to run or use the files."""
    names = [path.name for path in paths]
    if to == "c":
        sources = " ".join(name for name in names if name.endswith(".c"))
        if controller:
            return f"cc -std=c99 -O2 {sources} -lm -o replay && ./replay"
        return f"cc -O2 -c {sources}" if law else f"cc -O2 {sources} -lm -o run && ./run run.csv"
    if to == "arduino":
        return f"copy the folder to the libraries of Arduino, and open {names[-1]}"
    if to == "js":
        program = next(name for name in names if law or name.endswith(".run.mjs"))
        return f'import {{law}} from "./{program}"' if law else f"node {program} > run.csv"
    call = names[0].removesuffix(".m")
    return f"{call}(3e5, 0.1)" if law else f"octave --eval \"run_{call}('run.csv')\""
