"""What a plant that was never seen costs: trace, derivatives, print, compile; another parameter set; the cache."""

from __future__ import annotations

import dataclasses
import os
import pathlib
import subprocess
import sys
import tempfile
from collections.abc import Callable
from typing import Any

from filling import hanging, runs
from measure import Bar, Section, interleaved, of_time, show

from airmuscle.compile import System
from airmuscle.compile.program import Program, compile_system
from airmuscle.core import autodiff
from airmuscle.mechanism import HangingMass
from airmuscle.plant.plant import Plant
from airmuscle.simulation.integrators import DormandPrince8

HEADING = ("what", "median", "least")
TEXT = (
    "In a process that has compiled a plant before; what is kept of earlier traces is thrown away each time. The first "
    "plant of a process also starts CasADi and LLVM, which `Process start` below counts."
)
MUSCLES = 24
WHY = (
    "each of these muscles has a surface with its tangent, so that the plant is printed as more than 40 000 "
    "lines; LLVM's optimisation and code generation of functions so long take most of the time"
)
ONE_RUN = """
import sys
from filling import runs
from airmuscle.simulate import simulate
run = runs()[int(sys.argv[1])]
simulate(run.system, run.command, duration=0.1, start=run.start)
"""


def fresh(system: System) -> Program:
    """The program of a system as if its laws had never been traced."""
    autodiff._traced_functions.clear()
    return Program(system)


def with_step(system: System) -> Any:
    """A fresh program and its printed step of ode8, 13 stages in one function."""
    program = fresh(system)
    return program.step(*DormandPrince8(1e-4).tableau(), compile_system(system).parameters)


def many_muscles() -> Plant:
    """As many muscles as an arm has, each with its valves, on one mass."""
    plant = hanging()
    muscles = tuple(dataclasses.replace(plant.muscles[0], name=f"muscle{i}") for i in range(MUSCLES))
    return dataclasses.replace(
        plant, muscle=muscles, circuit=(plant.circuits[0],) * MUSCLES, mechanism=HangingMass(100.0)
    )


def cache_counts() -> tuple[int, ...]:
    """Files in the kernels' cache after each of three processes, with a plant of another size each."""
    counts = []
    with tempfile.TemporaryDirectory() as folder:
        for size in (3, 6, 10):
            process(["-c", ONE_RUN, str(size)], folder)
            counts.append(sum(path.is_file() for path in pathlib.Path(folder).rglob("*")))
    return tuple(counts)


def process(arguments: list[str], cache: str | None = None) -> str:
    """What Python prints in a process of its own, with this folder as the kernels' cache; it may keep bytecode."""
    here = pathlib.Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parent / "src"), os.environ.get("PYTHONPATH", "")])
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment = {**kept, "PYTHONPATH": path} | ({"NUMBA_CACHE_DIR": cache} if cache else {})
    done = subprocess.run(
        [sys.executable, *arguments], env=environment, check=True, capture_output=True, cwd=here, text=True
    )
    return done.stdout


def section(rounds: int = 5) -> Section:
    """All of it."""
    systems = {size: run.system for size, run in runs().items()}
    heavier, big = dataclasses.replace(hanging(), mechanism=HangingMass(6.0)), many_muscles()
    compile_system(systems[3])
    variants: dict[str, Callable[[], Any]] = {
        f"new plant, {n} states": lambda s=s: fresh(s) for n, s in systems.items()
    }
    variants["new plant, 3 states, and its step of ode8"] = lambda: with_step(systems[3])
    variants["another parameter set of a known plant"] = lambda: compile_system(heavier)
    times = interleaved(variants, rounds)
    times |= interleaved({f"new plant, {MUSCLES} muscles on one mass, 26 states": lambda: fresh(big)}, 2)
    counts = cache_counts()
    rows = [(name, of_time(t.median), of_time(t.least)) for name, t in times.items()]
    rows.append(("files in the cache after each of three processes", ", ".join(map(str, counts)), ""))
    bars = (
        Bar("new plant, 10 states", times["new plant, 10 states"].least, 0.3, "s"),
        Bar(f"new plant, {MUSCLES} muscles", list(times.values())[-1].least, 4.0, "s", why=WHY),
        Bar("files added to the cache by a second and third process", counts[-1] - counts[0], 0, "files"),
    )
    return Section("A new plant", TEXT, HEADING, tuple(rows), bars)


if __name__ == "__main__":
    show(section())
