"""Models for simulators by `airmuscle export`: FMUs, MuJoCo plugins, robots, Modelica and batched actuators."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...core import check_writable
from ...files import list_plants
from ...files.library import load_law, read_toml
from ...files.scenario.scenario import load_scenario
from ..export import write_controller_fmu, write_fmu, write_modelica, write_mujoco_plugin, write_ssp
from ..export.compiler import Platform
from ..export.learning import Stack, regulated_plant, write_actuator
from ..export.robot_description import WRITERS
from .terminal import echo, print_json


def export_fmu(
    source: str, out: Path, name: str, tunable: Sequence[str] | None, fmi: int, binary: bool, platforms: list[Platform],
    part: str, json: bool,
) -> None:  # fmt: skip
    """Write the FMU of a plant or of its controller, or both as an SSP package, into a folder or to a file.

    part  plant, controller, or ssp
    """
    suffix = ".ssp" if part == "ssp" else ".fmu"
    path = out if out.suffix == suffix else out / f"{name}{suffix}"
    check_writable(path.parent, shared=path.parent.exists())  # several commands may write into one folder
    scenario = load_scenario(source)
    common: dict[str, Any] = {
        "fmi": fmi, "name": name, "title": scenario.title, "binary": binary, "platforms": platforms,
    }  # fmt: skip
    if part == "controller":
        written = write_controller_fmu(scenario.problem, path, **common)
    else:
        write = write_ssp if part == "ssp" else write_fmu
        written = write(scenario.problem, path, tunable=tunable, **common)
    names = ", ".join(written.platforms)
    binaries = f"with sources and a binary for {names}" if names else f"sources without a binary: {written.remark}"
    lines = (
        f"FMI {fmi}.0, {'Model Exchange and ' if part == 'plant' else ''}Co-Simulation, {binaries}",
        f"run: fmpy simulate {path}" if part == "plant" else f"inputs: fmpy info {path}" if part == "controller" else
        "open: SystemStructure.ssd joins plant and controller",
    )  # fmt: skip
    tell(json, [path], *lines, platforms=list(written.platforms), remark=written.remark)


def export_mujoco(source: str, out: Path, name: str, muscle: str, json: bool) -> None:
    """Write a MuJoCo plugin into a folder."""
    made = write_mujoco_plugin(load_scenario(source).plant, out, name=name, muscle=muscle)
    files = [path for path in (made.source, made.library) if path is not None]
    low, high = made.control_range
    size = f'actdim="{len(made.plant.states)}" dyntype="user" ctrlrange="{low:g} {high:g}"'
    lines = (
        f"plugin: {made.plugin_name}" + (f", source only: {made.remark}" if made.remark else ""),
        f'MJCF: <plugin plugin="{made.plugin_name}" tendon="NAME" {size}/>',
    )
    tell(json, files, *lines, plugin=made.plugin_name, remark=made.remark)


def export_robot(source: str, out: Path, name: str, to: str, json: bool) -> None:
    """Write the robot description of a joint or an arm into a folder."""
    written = WRITERS[to](load_scenario(source).plant, out, name=name)
    plugins = [path for each in written.plugins for path in (each.source, each.library) if path is not None]
    remarks, left = list(dict.fromkeys(each.remark for each in written.plugins if each.remark)), list(written.left_out)
    lines = [f"plugins, source only: {remark}" for remark in remarks]
    lines += [f"left out: {', '.join(left)}"] if left else []
    tell(json, [written.path, *plugins], *lines, remarks=remarks, left_out=left)


def export_actuator(source: str, out: Path, name: str, muscle: str, stack: Stack, json: bool) -> None:
    """Write the batched actuator of a muscle of a plant, or of a muscle behind a pressure regulator."""
    if _is_plant(source):
        paths = write_actuator(load_scenario(source).plant, out, stack, name=name, muscle=muscle)
    else:
        entry = load_law(source)
        paths = write_actuator(
            regulated_plant(entry.muscle), out, stack, name=name, title=entry.title, uncertainty=entry.uncertainty
        )
    tell(json, paths)


def _is_plant(source: str) -> bool:
    """Whether a source is a plant of the library or a scenario file, not a muscle."""
    file = Path(source)
    return source in list_plants() if not file.exists() else "plant" in read_toml(file)


def export_modelica(source: str, out: Path, name: str, tunable: Sequence[str] | None, json: bool) -> None:
    """Write a Modelica package into a folder."""
    scenario = load_scenario(source)
    paths = write_modelica(scenario.problem, out, name=name, title=scenario.title, tunable=tunable)
    tell(json, paths, f'Modelica: loadFile("{paths[0]}"); block {name}.Plant')


def tell(json: bool, files: Sequence[Path], *lines: str, **more: Any) -> None:
    """The files of an export and lines on their use, or as JSON the files and more."""
    if json:
        print_json({"files": [str(file) for file in files], **more})
        return
    for line in (*(f"file: {file}" for file in files), *lines):
        echo(line)
