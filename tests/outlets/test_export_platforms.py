"""Binaries of FMUs for other platforms: each is a shared library of its format and processor that
exports FMI functions.

The same cross compiler makes WebAssembly of printed C.
"""

from __future__ import annotations

import importlib.util
import zipfile
from pathlib import Path

import numpy as np
import plants
import printed
import pytest
from command_line import airmuscle

from airmuscle.core import leaves
from airmuscle.engine import Problem, RungeKutta4, Schedule
from airmuscle.errors import ParameterError
from airmuscle.files import load_law
from airmuscle.outlets import C99, write_fmu, write_law
from airmuscle.outlets.export.compiler import (
    PLATFORMS,
    find_cross_compiler,
    find_platform,
    run_command,
    this_platform,
)

EXAMPLE = Path(__file__).parents[2] / "examples" / "fill_discharge.toml"
FORMATS = {
    "linux64": (b"\x7fELF\x02\x01", 18, 62),
    "linux-aarch64": (b"\x7fELF\x02\x01", 18, 183),
    "win64": (b"MZ", None, 0x8664),
    "win-aarch64": (b"MZ", None, 0xAA64),
    "darwin64": (b"\xcf\xfa\xed\xfe", 4, 0x01000007),
    "darwin-aarch64": (b"\xcf\xfa\xed\xfe", 4, 0x0100000C),
}
"""First bytes of a file, where the number of its processor stands, and this number: ELF, PE and
Mach-O, 64 bits.
"""


def problem():
    plant = plants.EXAMPLES["dmsp-20-300"]
    return Problem(
        plant, Schedule({}), 0.1, plant.state_at(pressure=1e5), integrator=RungeKutta4(1e-3)
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", PLATFORMS)
def test_each_binary_is_a_library_of_its_platform(name, tmp_path):
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("needs the package ziglang")
    platform = PLATFORMS[name]
    for fmi in (2, 3):
        path = tmp_path / f"{fmi}.fmu"
        written = write_fmu(
            problem(), path, fmi=fmi, name="plant", tunable=[], platforms=[platform]
        )
        assert written.platforms == (platform.folder(fmi),)
        binary = zipfile.ZipFile(path).read(
            f"binaries/{platform.folder(fmi)}/plant{platform.suffix}"
        )
        magic, at, processor = FORMATS[name]
        assert binary.startswith(magic)
        if at is None:  # the header of PE is where the number at 0x3C says
            at = int.from_bytes(binary[0x3C:0x40], "little") + 4
        assert (
            int.from_bytes(binary[at : at + (4 if "darwin" in name else 2)], "little") == processor
        )
        for function in (f"fmi{fmi}DoStep", f"fmi{fmi}SetTime", f"fmi{fmi}FreeInstance"):
            assert function.encode() + b"\0" in binary


@pytest.mark.slow
def test_several_platforms_are_in_one_file_and_its_bytes_are_the_same(tmp_path):
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("needs the package ziglang")
    wanted = [PLATFORMS["linux64"], PLATFORMS["linux-aarch64"]]
    for folder in ("a", "b"):
        write_fmu(
            problem(), tmp_path / folder / "plant.fmu", name="plant", tunable=[], platforms=wanted
        )
    assert (tmp_path / "a" / "plant.fmu").read_bytes() == (
        tmp_path / "b" / "plant.fmu"
    ).read_bytes()
    names = zipfile.ZipFile(tmp_path / "a" / "plant.fmu").namelist()
    assert [n for n in names if n.startswith("binaries/")] == [
        "binaries/aarch64-linux/plant.so",
        "binaries/x86_64-linux/plant.so",
    ]


def test_without_the_cross_compiler_the_package_is_named_and_nothing_is_written(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("airmuscle.outlets.export.compiler.PACKAGE", "package_that_is_missing")
    with pytest.raises(
        ParameterError,
        match=r"need the package package_that_is_missing.*pip install .airmuscle\[fmu\]",
    ):
        write_fmu(problem(), tmp_path / "plant.fmu", platforms=[PLATFORMS["win64"]])
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_platform_is_refused_with_the_nearest():
    with pytest.raises(
        ParameterError, match=r"no platform 'win46'; there are linux64, .*Did you mean 'win64'"
    ):
        find_platform("win46")


def test_the_folders_are_those_of_the_standard():
    assert {name: (each.folder(2), each.folder(3)) for name, each in PLATFORMS.items()} == {
        "linux64": ("linux64", "x86_64-linux"),
        "linux-aarch64": ("aarch64-linux", "aarch64-linux"),
        "win64": ("win64", "x86_64-windows"),
        "win-aarch64": ("aarch64-windows", "aarch64-windows"),
        "darwin64": ("darwin64", "x86_64-darwin"),
        "darwin-aarch64": ("aarch64-darwin", "aarch64-darwin"),
    }
    assert this_platform().suffix in (".so", ".dll", ".dylib")


def test_the_command_refuses_options_that_exclude_each_other(tmp_path):
    done = airmuscle(
        "export",
        EXAMPLE,
        "--to",
        "fmu",
        "--sources-only",
        "--platforms",
        "win64",
        "--out",
        tmp_path,
    )
    assert done.exit_code == 2
    assert "--sources-only and --platforms exclude each other" in " ".join(
        done.output.replace("\u2502", " ").split()
    )


WEBASSEMBLY = """
import {readFileSync} from "fs";
const {p, points} = JSON.parse(readFileSync("data.json"));
const {instance: {exports: law}} = await WebAssembly.instantiate(readFileSync("law.wasm"));
const base = law.memory.buffer.byteLength;
law.memory.grow(1);
const at = (offset, length) => new Float64Array(law.memory.buffer, base + 8 * offset, length);
at(0, p.length).set(p);
law.law_prepare(base, base + 8 * 1000);
console.log(JSON.stringify(points.map(([pressure, contraction]) => {
  law.law_evaluate(pressure, contraction, base + 8 * 1000, base + 8 * 2000);
  return [...at(2000, 3)];
})));
"""


@pytest.mark.slow
def test_printed_c_runs_as_webassembly(tmp_path):
    """As the guide states: compiled by zig, called in Node."""
    if importlib.util.find_spec("ziglang") is None:
        pytest.skip("needs the package ziglang")
    printed.require("node")
    law = load_law("dmsp-20-300").characteristic
    write_law(law, tmp_path, C99(), name="law")
    exported = [f"-Wl,--export=law_{name}" for name in ("prepare", "evaluate")]
    target = [
        "-target",
        "wasm32-wasi",
        "-mexec-model=reactor",
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-s",
    ]
    run_command(
        [*find_cross_compiler(), *target, "law.c", "-o", "law.wasm", *exported, "-lm"],
        str(tmp_path),
    )
    points = [(2e5, 0.0), (3e5, 0.1), (5e5, 0.2)]
    data = {"p": [leaf.value for leaf in leaves(law)], "points": points}
    found = np.array(printed.run_node(WEBASSEMBLY, data, tmp_path))
    np.testing.assert_allclose(found[:, 0], [law.force(*point) for point in points], rtol=1e-12)
