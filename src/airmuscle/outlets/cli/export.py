"""`airmuscle export`: a scenario or a law as a program in another language."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...core.atomic_output import check_writable
from ...files.library.entry_file import load_law
from ...files.scenario.scenario import load_scenario
from ..export import (
    C99,
    PRECISIONS,
    JavaScript,
    Octave,
    OnnxStack,
    Stack,
    Target,
    TorchStack,
    WarpStack,
    write_controller,
    write_law,
    write_program,
)
from ..export.compiler import PLATFORMS, PROCESSORS, BuiltProgram, build_and_run, find_platform, run_in_emulator
from ..export.identifiers import make_identifier
from ..export.robot_description import WRITERS
from .export_models import export_actuator, export_fmu, export_modelica, export_mujoco, export_robot
from .options import Folder, Json, complete_entry
from .terminal import echo, print_json

TARGETS: dict[str, Target] = {"c": C99(), "js": JavaScript(), "octave": Octave()}
"""Languages by the names of the option --to."""
STACKS: dict[str, Stack] = {"torch": TorchStack(), "warp": WarpStack(), "onnx": OnnxStack()}
"""Learning stacks by the names of the option --to."""
NAMES = (*TARGETS, "arduino", "fmu", "ssp", "mujoco", *WRITERS, "modelica", *STACKS)
"""All values of the option --to."""
DEFAULT_FOLDER = Path("export")

Source = Annotated[
    str,
    typer.Argument(
        metavar="SOURCE",
        help="A scenario file or a plant of the library; with --law a library entry or a muscle file.",
        autocompletion=complete_entry,
    ),
]
To = Annotated[str, typer.Option("--to", metavar="TARGET", help=f"Target: {', '.join(NAMES)}.")]
ProgramName = Annotated[
    str, typer.Option("--name", metavar="NAME", help="Name of the program; default: that of the source.")
]
Law = Annotated[bool, typer.Option("--law", help="Export only the static characteristic of a muscle.")]
ControllerOnly = Annotated[
    bool, typer.Option("--controller", help="Export only the controller of a scenario: c, arduino, fmu.")
]
Build = Annotated[
    bool, typer.Option("--build", help="Compile the C program with the compiler of this machine, and run it.")
]
Tunable = Annotated[
    list[str] | None,
    typer.Option(
        "--tunable", metavar="PATH",
        help="A parameter that the program can change; repeatable. Default: all, of a controller none.",
    ),
]  # fmt: skip
PrecisionName = Annotated[
    str, typer.Option("--precision", metavar="double|float", help="Type of the numbers of a controller.")
]
ProcessorName = Annotated[
    str,
    typer.Option(
        "--processor", metavar="NAME",
        help=f"With --controller --build: run in the emulator QEMU as {' or '.join(PROCESSORS)}, not on this machine.",
    ),
]  # fmt: skip
Fmi = Annotated[
    int | None, typer.Option("--fmi", metavar="2|3", help="Version of FMI for --to fmu and ssp. Default: 3.")
]
MuscleName = Annotated[
    str, typer.Option("--muscle", metavar="NAME", help="One muscle of the plant; --to mujoco, torch, warp, onnx.")
]
SourcesOnly = Annotated[bool, typer.Option("--sources-only", help="An FMU without a binary; --to fmu, ssp.")]


Platforms = Annotated[
    list[str] | None,
    typer.Option(
        "--platforms", metavar="NAME",
        help=f"Binaries of an FMU for a platform, by the package ziglang; repeatable: {', '.join(PLATFORMS)}. Default: "
        "this machine.",
    ),
]  # fmt: skip


def export(
    source: Source, to: To, out: Folder = DEFAULT_FOLDER, name: ProgramName = "", law: Law = False,
    controller: ControllerOnly = False, build: Build = False, tunable: Tunable = None, fmi: Fmi = None,
    sources_only: SourcesOnly = False, platforms: Platforms = None, muscle: MuscleName = "",
    precision: PrecisionName = "double", processor: ProcessorName = "", json: Json = False,
) -> None:  # fmt: skip
    """Export to C, MATLAB, FMU, MuJoCo, PyTorch and other targets.

    \b
    The program contains the equations of the plant, the integrator, and a run of the scenario that writes CSV; in C,
    JavaScript and MATLAB also the controller and its drivers. Nothing of Python or airmuscle is needed to run it. Each
    file states version, hash of the model, parameters, references and licence; the same scenario gives the same files.

    \b
    Examples:
      airmuscle export examples/fill_discharge.toml --to c --out fill_c
      airmuscle export examples/fill_discharge.toml --to octave --tunable mechanism.mass --out fill_m
      airmuscle export dmsp-20-300 --law --to js --out law_js
      airmuscle export dmsp-20-300 --to torch --out actuator
      airmuscle export joint-dmsp-20-matrix --to mjcf --out robot
      airmuscle export examples/pressure_loop.toml --to c --out loop_c
      airmuscle export examples/pressure_loop.toml --controller --to c --out controller
      airmuscle export examples/pressure_loop.toml --controller --to c --precision float --build --processor cortex-m4
      airmuscle export examples/pressure_loop.toml --controller --to arduino --precision float --out pressure_loop
      airmuscle export examples/fill_discharge.toml --to fmu --fmi 2 --out fill.fmu
      airmuscle export examples/pressure_loop.toml --controller --to fmu --out controller.fmu
      airmuscle export examples/pressure_loop.toml --to ssp --out loop.ssp
    """
    _check_options(to, law, controller, build, tunable, fmi is not None or sources_only or bool(platforms))
    _check_controller_options(controller, build, precision, processor)
    name = name or make_identifier(Path(source).stem)
    if to in ("fmu", "ssp"):
        if sources_only and platforms:
            raise typer.BadParameter("--sources-only and --platforms exclude each other.")
        targets = [find_platform(each) for each in dict.fromkeys(platforms or ())]
        part = "ssp" if to == "ssp" else "controller" if controller else "plant"
        export_fmu(source, out, name, tunable, 3 if fmi is None else fmi, not sources_only, targets, part, json)
        return
    if muscle and to not in ("mujoco", *STACKS):
        raise typer.BadParameter(f"--muscle belongs to --to mujoco, {', '.join(STACKS)}.")
    check_writable(out)
    if to not in TARGETS and to != "arduino":
        _export_model(source, out, to, name, muscle, tunable, json)
        return
    paths = _write(source, out, to, name, law, controller, tunable, precision)
    built = (run_in_emulator(paths, PROCESSORS[processor]) if processor else build_and_run(paths)) if build else None
    if json:
        result = {} if built is None else _build_results(built)
        print_json({"files": [str(path) for path in paths], **result})
        return
    for path in paths:
        echo(f"file: {path}")
    if built is not None:
        _print_build(built, controller)
    echo(f"run: {_instruction(to, paths, law, controller)}")


def _export_model(
    source: str, out: Path, to: str, name: str, muscle: str, tunable: list[str] | None, json: bool
) -> None:
    """Write a model for a simulator or a learning stack."""
    if to == "mujoco":
        export_mujoco(source, out, name, muscle, json)
    elif to in WRITERS:
        export_robot(source, out, name, to, json)
    elif to in STACKS:
        export_actuator(source, out, name, muscle, STACKS[to], json)
    else:
        export_modelica(source, out, name, tunable, json)


def _write(
    source: str, out: Path, to: str, name: str, law: bool, controller: bool, tunable: list[str] | None, precision: str
) -> tuple[Path, ...]:
    """Write a law, a controller, or a plant with its run."""
    if law:
        entry = load_law(source)
        return write_law(entry.characteristic, out, TARGETS[to], name=name, title=entry.title)
    scenario = load_scenario(source)
    if controller:
        return write_controller(
            scenario.problem, out, name=name, title=scenario.title, tunable=tunable or (),
            precision=PRECISIONS[precision], arduino=to == "arduino",
        )  # fmt: skip
    return write_program(
        scenario.problem, out, TARGETS[to], name=name, title=scenario.title, tunable=tunable, columns=scenario.columns
    )


def _print_build(built: BuiltProgram, controller: bool) -> None:
    """What the program printed; of a run, whose output is CSV, the number of its rows."""
    text = (
        built.output.strip() if controller else f"{len(built.output.splitlines()) - 1} rows; {built.messages.strip()}"
    )
    size = "unknown" if built.code_size is None else f"{built.code_size} bytes"
    stack = "" if built.stack_size is None else f", stack {built.stack_size} bytes, both without the C library"
    echo(f"program: {text}; code {size}{stack}")


def _build_results(built: BuiltProgram) -> dict[str, str | int | None]:
    """The results of a build for JSON."""
    stack = {} if built.stack_size is None else {"stack_bytes": built.stack_size}
    return {"output": built.output, "code_bytes": built.code_size, **stack}


def _check_controller_options(controller: bool, build: bool, precision: str, processor: str) -> None:
    """Raise BadParameter for options of a controller that do not fit together."""
    if precision not in PRECISIONS:
        raise typer.BadParameter(f"--precision {precision}: there are {', '.join(PRECISIONS)}.")
    if precision != "double" and not controller:
        raise typer.BadParameter("--precision belongs to --controller; plants are computed in double precision.")
    if processor and processor not in PROCESSORS:
        raise typer.BadParameter(f"--processor {processor}: there are {', '.join(PROCESSORS)}.")
    if processor and not (controller and build):
        raise typer.BadParameter("--processor belongs to --controller --build.")


def _check_options(
    to: str, law: bool, controller: bool, build: bool, tunable: list[str] | None, of_an_fmu: bool
) -> None:
    """Raise BadParameter for options that do not fit together."""
    if to not in NAMES:
        raise typer.BadParameter(f"--to {to}: there are {', '.join(NAMES)}.")
    if controller and (law or to not in ("c", "arduino", "fmu")):
        raise typer.BadParameter(
            "--controller: a controller is exported to C, and without --law; write --to c, --to arduino or --to fmu."
        )
    if controller and to == "fmu" and tunable:
        raise typer.BadParameter("--tunable: all parameters of a controller in an FMU can be changed; leave it out.")
    if to == "arduino" and not controller:
        raise typer.BadParameter("--to arduino: an Arduino library contains a controller; add --controller.")
    if build and (law or to != "c"):
        raise typer.BadParameter("--build: there is a program to compile with --to c and without --law.")
    if law and to not in TARGETS:
        raise typer.BadParameter(f"--law: {to} contains a plant; leave --law out, or write --to c.")
    if to in ("mujoco", *WRITERS) and tunable:
        raise typer.BadParameter("--tunable: all parameters of an actuator can be changed; leave it out.")
    if law and tunable:
        raise typer.BadParameter("--tunable: all parameters of a law can be changed; leave it out.")
    if of_an_fmu and to not in ("fmu", "ssp"):
        raise typer.BadParameter("--fmi, --sources-only and --platforms belong to --to fmu and ssp.")


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
