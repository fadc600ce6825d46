"""Preparation of a new plant: trace, derivatives, code generation, compilation; new parameters; the
cache.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pathlib
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from typing import Any
from unittest import mock

from filling import hanging, runs
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am
from airmuscle.core import autodiff
from airmuscle.core.system import System
from airmuscle.engine.compile.program import Program, compile_system

HEADER = ("task", "median", "minimum")
TEXT = (
    "In a process that has already compiled a plant; the caches of traced functions and of machine"
    " code are empty each time. The first plant of a process also loads LLVM, which is"
    " part of `Process start` below. The plant with energy meters has four muscles with friction,"
    " creep and a lagging wall, heat, and tubes of two volumes."
)
MUSCLES = 24
REASON = (
    "the law of a muscle is printed once, but its instructions are recorded and differentiated for"
    " each muscle"
)
ONE_RUN = """
import sys
from filling import runs
from airmuscle import simulate
run = runs()[int(sys.argv[1])]
simulate(run.system, run.command, duration=0.1, initial_state=run.initial_state)
"""


@contextlib.contextmanager
def without_stored_code() -> Iterator[None]:
    """A folder without machine code in place of the kernel cache."""
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.dict(os.environ, {"AIRMUSCLE_CACHE_DIR": folder}),
    ):
        yield


def compile_anew(system: System) -> Program:
    """The program of a system, without the caches of traced laws and of machine code."""
    autodiff._recorded_methods.clear()
    with without_stored_code():
        return Program(system)


def compile_with_step(system: System) -> Any:
    """A new program and its compiled step of ode8, 13 stages in one function."""
    program = compile_anew(system)
    with without_stored_code():
        return program.step(am.DormandPrince8(1e-4).tableau(), compile_system(system).parameters)


def many_muscles() -> am.Plant:
    """24 muscles, each with two valves, on one mass."""
    plant = hanging()
    muscles = tuple(
        dataclasses.replace(plant.muscles[0], name=f"muscle{i}") for i in range(MUSCLES)
    )
    return dataclasses.replace(
        plant,
        muscle=muscles,
        circuit=(plant.circuits[0],) * MUSCLES,
        mechanism=am.HangingMass(100.0),
    )


def with_meters() -> am.physics.WithEnergyMeters:
    """Four muscles with friction, creep and a lagging wall, heat and tubes of two volumes, and all
    energy meters.
    """
    plant = hanging(4)
    tube = am.physics.Tube(am.physics.TubeOrifice(1.0, 3e-3), 1e-5, 2)
    parts = (
        am.friction.LuGre(5e4, 15.0, 5.0, 0.01, 50.0, 20.0),
        am.physics.CreepElements((2e4, 1e4), (0.1, 2.0)),
        am.physics.ViscoelasticWall(2e-11, 0.05),
    )
    friction, creep, wall = parts
    muscles = tuple(
        dataclasses.replace(m, friction=friction, creep=creep, wall=wall) for m in plant.muscles
    )
    circuits = tuple(am.physics.WithTubes(circuit, tube) for circuit in plant.circuits)
    return am.physics.WithEnergyMeters(
        dataclasses.replace(
            plant, muscle=muscles, circuit=circuits, gas=am.physics.EnergyBalance(0.5)
        )
    )


def cache_counts() -> tuple[int, ...]:
    """Number of files in the kernel cache after each of three processes, with plants of different
    size.
    """
    counts = []
    with tempfile.TemporaryDirectory() as folder:
        for size in (3, 6, 10):
            run_python(["-c", ONE_RUN, str(size)], folder)
            counts.append(sum(path.is_file() for path in pathlib.Path(folder).rglob("*")))
    return tuple(counts)


def run_python(arguments: list[str], cache: str | None = None) -> str:
    """The output of a Python process, with `cache` as folder of the kernel cache; bytecode is
    written as usual.
    """
    here = pathlib.Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parent / "src"), os.environ.get("PYTHONPATH", "")])
    inherited = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    environment = {**inherited, "PYTHONPATH": path} | ({"NUMBA_CACHE_DIR": cache} if cache else {})
    done = subprocess.run(
        [sys.executable, *arguments],
        env=environment,
        check=True,
        capture_output=True,
        cwd=here,
        text=True,
    )
    return done.stdout


def section(rounds: int = 5) -> Section:
    """The complete benchmark."""
    systems = {size: run.system for size, run in runs().items()}
    heavier, big = dataclasses.replace(hanging(), mechanism=am.HangingMass(6.0)), many_muscles()
    metered = with_meters()
    compile_system(systems[3])
    variants: dict[str, Callable[[], Any]] = {
        f"new plant, {n} states": lambda s=s: compile_anew(s) for n, s in systems.items()
    }
    variants["new plant, 3 states, with compiled step of ode8"] = lambda: compile_with_step(
        systems[3]
    )
    meters = f"new plant with energy meters, {len(metered.states)} states"
    variants[meters] = lambda: compile_anew(metered)
    variants["new parameter values of a known plant"] = lambda: compile_system(heavier)
    times = time_variants(variants, rounds)
    times |= time_variants(
        {f"new plant, {MUSCLES} muscles on one mass, 26 states": lambda: compile_anew(big)}, 2
    )
    counts = cache_counts()
    rows = [(name, format_time(t.median), format_time(t.minimum)) for name, t in times.items()]
    rows.append(
        ("files in the cache after each of three processes", ", ".join(map(str, counts)), "")
    )
    targets = (
        Target("new plant, 10 states", times["new plant, 10 states"].minimum, 0.3, "s"),
        Target(meters, times[meters].minimum, 2.0, "s"),
        Target(
            f"new plant, {MUSCLES} muscles",
            list(times.values())[-1].minimum,
            4.0,
            "s",
            reason=REASON,
        ),
        Target(
            f"new plant, {MUSCLES} muscles / six muscles",
            list(times.values())[-1].minimum / times["new plant, 8 states"].minimum,
            4.0,
            "x",
            reason=REASON,
        ),
        Target(
            "files added to the cache by the second and third process",
            counts[-1] - counts[0],
            0,
            "files",
        ),
    )
    return Section("A new plant", TEXT, HEADER, tuple(rows), targets)


if __name__ == "__main__":
    print_section(section())
