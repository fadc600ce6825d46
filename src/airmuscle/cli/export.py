"""`airmuscle export`: a scenario or a law as a program in another language."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..export import C99, JavaScript, Octave, Target, write_controller, write_law, write_program
from ..export.identifiers import make_identifier
from ..library.law_file import load_law
from ..report.output_folder import check_writable
from ..scenario.scenario import load_scenario
from .options import Folder, Json
from .terminal import echo, print_json

TARGETS: dict[str, Target] = {"c": C99(), "js": JavaScript(), "octave": Octave()}
"""Targets by the names of the option --to."""


Source = Annotated[
    str,
    typer.Argument(
        metavar="SOURCE", help="A scenario file or a plant of the library; with --law a library entry or a muscle file."
    ),
]
To = Annotated[str, typer.Option("--to", metavar="TARGET", help=f"Language: {', '.join(TARGETS)}.")]
ProgramName = Annotated[
    str, typer.Option("--name", metavar="NAME", help="Name of the program; default: that of the source.")
]
Law = Annotated[bool, typer.Option("--law", help="Export only the static characteristic of a muscle.")]
ControllerOnly = Annotated[
    bool, typer.Option("--controller", help="Export only the controller of a scenario, to C for a microcontroller.")
]
Tunable = Annotated[
    list[str] | None,
    typer.Option(
        "--tunable", metavar="PATH",
        help="A parameter that the program can change; repeatable. Default: all, of a controller none.",
    ),
]  # fmt: skip


def export(
    source: Source, to: To, out: Folder = Path("export"), name: ProgramName = "", law: Law = False,
    controller: ControllerOnly = False, tunable: Tunable = None, json: Json = False,
) -> None:  # fmt: skip
    """Export a scenario, law or controller to C, JavaScript or MATLAB.

    \b
    The program contains the equations of the plant, the integrator, and a run of the scenario that writes CSV. Nothing
    of Python or airmuscle is needed to run it. Each file states version, hash of the model, parameters, references and
    licence; the same scenario gives the same files.

    \b
    Examples:
      airmuscle export examples/fill_discharge.toml --to c --out fill_c
      airmuscle export examples/fill_discharge.toml --to octave --tunable mechanism.mass --out fill_m
      airmuscle export dmsp-20-300 --law --to js --out law_js
      airmuscle export examples/pressure_loop.toml --controller --to c --out controller
    """
    if to not in TARGETS:
        raise typer.BadParameter(f"--to {to}: there are {', '.join(TARGETS)}.")
    if controller and (law or to != "c"):
        raise typer.BadParameter("--controller: a controller is exported to C, and without --law; write --to c.")
    if law and tunable:
        raise typer.BadParameter("--tunable: all parameters of a law can be changed; leave it out.")
    check_writable(out)
    name = name or make_identifier(Path(source).stem)
    if law:
        entry = load_law(source)
        paths = write_law(entry.characteristic, out, TARGETS[to], name=name, title=entry.title)
    elif controller:
        scenario = load_scenario(source)
        paths = write_controller(scenario.problem, out, name=name, title=scenario.title, tunable=tunable or ())
    else:
        scenario = load_scenario(source)
        paths = write_program(
            scenario.problem, out, TARGETS[to], name=name, title=scenario.title, tunable=tunable,
            columns=scenario.columns,
        )  # fmt: skip
    if json:
        print_json({"files": [str(path) for path in paths]})
        return
    for path in paths:
        echo(f"file: {path}")
    echo(f"run: {_instruction(to, paths, law, controller)}")


def _instruction(to: str, paths: tuple[Path, ...], law: bool, controller: bool) -> str:
    """How to run or use the files."""
    names = [path.name for path in paths]
    if to == "c":
        sources = " ".join(name for name in names if name.endswith(".c"))
        if controller:
            return f"cc -std=c99 -O2 {sources} -lm -o replay && ./replay"
        return f"cc -O2 -c {sources}" if law else f"cc -O2 {sources} -lm -o run && ./run run.csv"
    if to == "js":
        return f'import {{law}} from "./{names[0]}"' if law else f"node {names[1]} > run.csv"
    call = names[0].removesuffix(".m")
    return f"{call}(3e5, 0.1)" if law else f"octave --eval \"run_{call}('run.csv')\""
