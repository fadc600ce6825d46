"""Batch simulation of plants with different parameters: simulate_batch, equivalent C code and
vectorised NumPy.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any
from unittest import mock

import numpy as np
from batch_numpy import rk4
from filling import Array, hanging, runs
from measure import (
    PRINT_PEAK_MEMORY,
    Section,
    Target,
    Times,
    format_time,
    print_section,
    time_variants,
)
from ode8 import compile_source, compilers

import airmuscle as am
from airmuscle.core import tree
from airmuscle.engine import Double, Precision, Single
from airmuscle.engine.compile.llvm.processor import VARIABLE, possible_levels
from airmuscle.engine.processes import available_cores
from airmuscle.engine.run.batch.variations import default_states, variations_of

STEP = 1e-3
PLANTS = 10_000
DURATION = 5.0
SHORT = 0.1
"""Simulated time [s] of the NumPy variant; its time is scaled to DURATION, because all its steps
cost the same.
"""
SOURCE = pathlib.Path(__file__).with_name("batch.c")
OPTIMISED = ("-O3", "-ffast-math", "-fopenmp-simd")
KEEPS_NAN = "-fno-finite-math-only"
"""A flag after -ffast-math: NaN and infinity remain, as in the library, which must find a failed
step by them.
"""
WIDEST = "-mprefer-vector-width=512"
NARROWER = "x86-64-v3"
"""A processor with AVX2, without AVX-512."""
LEVELS = {"this processor": ""} | ({NARROWER: NARROWER} if NARROWER in possible_levels() else {})
LIMITS = {KEEPS_NAN: 1.15, "": 0.95}
"""Least ratio of gcc's time to the library's by a flag after -ffast-math."""
SPREAD = 0.05
COMMAND = am.Schedule({"fill": ((0.5, 1.0), (2.0, 0.0)), "discharge": ((3.0, 1.0), (4.0, 0.0))})
SWITCHED = (0.5, 2.0, 3.0, 4.0)
SINGLE_PLANTS = 20
"""Number of plants whose equilibria are also computed one by one."""
GROWTH = (1, 100, 1000, 10_000, 100_000)
HEADER = ("variant", "plants", "cores", "median", "minimum", "million plant steps per second")
TEXT = (
    "The plant with three states. Its 44 parameters are random for every plant, within 5 %"
    " (chosen). RK4 at 1e-3 s over 5 s; the final states are kept. The C code computes the same"
    " equations in blocks of 8, 16 or 32 lanes, with everything that depends only on parameters"
    " precomputed; the time of `simulate_batch` includes the validation of all parameters. NumPy"
    f" uses one core; {SHORT:g} s are simulated and scaled to 5 s. The C code has no branches; the"
    " library skips closed valves and the extrapolation beyond the validity range if no plant of a"
    " SIMD register needs them, as is the case here. All plants start at the same state. A batch"
    " without initial state first computes the equilibrium of each plant at ambient pressure,"
    " which is timed separately."
)
WIDTHS = (
    "The same plants on one core, CPU time. gcc with 32 lanes; -fno-finite-math-only after"
    " -ffast-math keeps NaN and infinity, as the library does, which finds a failed step by them."
    " x86-64-v3: plants in lanes, and gcc, for a processor with AVX2 and without AVX-512."
)
REASON = (
    "both are limited by the same multiplications, roots and divisions; the library skips closed"
    " valves and an extrapolation that no plant of a SIMD register needs, but also validates all"
    " parameters"
)
BUSY_REASON = "the cores of the machine are shared with other machines"


def random_parameters(plant: am.Plant, count: int) -> dict[str, Array]:
    """Random values of every parameter within SPREAD of its value and within its bounds, by
    path.
    """
    rng = np.random.default_rng(5)
    parameters = {}
    for leaf in tree.leaves(plant):
        values = leaf.value * (1 + SPREAD * rng.uniform(-1, 1, count))
        parameters[leaf.path] = np.clip(values, *leaf.declared.bounds)
    return parameters


def c_parameters(plant: Any, count: int) -> Array:
    """The parameters (46, N) of the C code, in its order."""
    muscle = plant.muscles[0]
    circuit = plant.circuits[0]
    load = plant.mechanism
    ambient = plant.ambient
    law = muscle.contractile
    k, c = _stretch(muscle.geometry)
    scale = am.physics.REFERENCE_DENSITY * np.sqrt(
        am.physics.REFERENCE_TEMPERATURE / ambient.temperature
    )
    validity_range = (
        (law.min_contraction, law.max_contraction),
        (
            law.min_pressure,
            law.max_pressure,
        ),
    )
    valves = [
        x
        for v in (circuit.fill, circuit.discharge)
        for x in (
            scale * v.conductance,
            v.critical_ratio,
            1 / (1 - v.critical_ratio),
            v.laminar_slope(),
        )
    ]
    rows = [1 / load.mass, load.gravity, 1 / muscle.geometry.resting_length, k, c * c]
    rows += [
        am.physics.GAS_CONSTANT * ambient.temperature,
        ambient.pressure,
        circuit.supply.pressure + ambient.pressure,
        *valves,
    ]
    rows += [x for low, high in validity_range for x in (low, 2 / (high - low))]
    rows += [
        law.min_force,
        law.max_force,
        muscle.spring.stiffness,
        muscle.damper.damping,
        muscle.damper.damping_slope,
    ]
    return np.array([np.broadcast_to(row, count) for row in (*rows, *law.coefficients)])


def _stretch(braid: Any) -> tuple[Array, Array]:
    volume_factor = np.pi * braid.radius**2 * braid.resting_length / np.sin(braid.braid_angle) ** 2
    return volume_factor, np.cos(braid.braid_angle)


def compile_library(folder: pathlib.Path, compiler: str, lanes: int, *flags: str) -> ctypes.CDLL:
    """The C code for so many lanes, compiled with these flags and those of all variants."""
    target = folder / f"batch{len(list(folder.iterdir()))}.so"
    compile_source([compiler, *OPTIMISED, *flags, f"-DLANES={lanes}"], SOURCE, target)
    return ctypes.CDLL(str(target))


def compile_libraries(folder: pathlib.Path) -> dict[str, tuple[ctypes.CDLL, int]]:
    """The C code compiled by each compiler, for several numbers of lanes, with default and maximum
    vector width.
    """
    libraries = {}
    for compiler in compilers():
        for wide in ((), (WIDEST,)):
            for lanes in (8, 16, 32):
                flags = ("-march=native", *wide)
                name = " ".join(["C,", compiler, *OPTIMISED[:2], *flags, f"{lanes} lanes"])
                library = compile_library(folder, compiler, lanes, *flags)
                libraries[name] = library, lanes
    return libraries


@contextlib.contextmanager
def restricted(level: str) -> Iterator[None]:
    """A block in which plants in lanes are compiled for a level of x86-64."""
    with mock.patch.dict(os.environ, {VARIABLE: level} if level else {}):
        yield


def name_of_c(level: str, flag: str) -> str:
    """The variant of gcc's C code for a level, with a flag after -ffast-math."""
    return " ".join(["C, gcc", *OPTIMISED[:2], *flags_of(level, flag)])


def flags_of(level: str, flag: str) -> tuple[str, ...]:
    """The flags of gcc for a level, with a flag after -ffast-math."""
    return f"-march={level or 'native'}", *filter(None, [flag])


def width_variants(
    folder: pathlib.Path, count: int, seconds: float
) -> dict[str, Callable[[], Array]]:
    """The library and gcc's C code on one core, for each level, the C code with NaN and without."""
    plant, start = hanging(), runs()[3].vector
    parameters = random_parameters(plant, count)
    table = c_parameters(tree.unflatten(plant, list(parameters.values())), count)

    def library(level: str) -> Array:
        with restricted(level):
            return run_library(plant, parameters, start, seconds, 1)

    variants: dict[str, Callable[[], Array]] = {}
    for where, level in LEVELS.items():
        variants[f"simulate_batch, {where}"] = functools.partial(library, level)
        for flag in LIMITS:
            code = compile_library(folder, "gcc", 32, *flags_of(level, flag))
            run = make_c_batch(code, 32, table, start, seconds)
            variants[name_of_c(level, flag)] = functools.partial(run, 1)
    return variants


def section_of_widths(rounds: int = 7, count: int = PLANTS, seconds: float = DURATION) -> Section:
    """The library and gcc's C code for processors with registers of different width, by CPU
    time.
    """
    title = "Batch and width of registers"
    if "gcc" not in compilers():
        return Section(title, "gcc is not installed.", HEADER, ())
    with tempfile.TemporaryDirectory() as folder:
        variants = width_variants(pathlib.Path(folder), count, seconds)
        final_states = {name: call() for name, call in variants.items()}
        check_final_states(final_states, "simulate_batch, this processor", runs()[3].nominal)
        times = time_variants(variants, rounds, time.process_time)
    targets = [
        Target(
            f"{name_of_c(level, flag)} / simulate_batch, {where}",
            times[name_of_c(level, flag)].ratio_to(times[f"simulate_batch, {where}"]),
            limit,
            "x",
            at_least=True,
        )
        for where, level in LEVELS.items()
        for flag, limit in LIMITS.items()
    ]
    rows = [_row(name, count, 1, timed, seconds) for name, timed in times.items()]
    return Section(title, WIDTHS, HEADER, tuple(rows), tuple(targets))


def make_c_batch(
    library: ctypes.CDLL, lanes: int, parameters: Array, start: Array, seconds: float
) -> Callable[[int], Array]:
    """A function of the number of threads that runs the batch in C and returns the final states (3,
    N).
    """
    count = parameters.shape[1]
    size = -(-parameters.shape[1] // lanes) * lanes
    padded = np.ascontiguousarray(np.pad(parameters, ((0, 0), (0, size - count)), mode="edge"))
    instants = np.ascontiguousarray(np.repeat(np.array(SWITCHED)[:, None], size, axis=1))
    pointer = ctypes.c_void_p
    long = ctypes.c_long
    library.batch.argtypes = [pointer, pointer, pointer, long, long, long, long, ctypes.c_double]

    def call(cores: int) -> Array:
        state = np.ascontiguousarray(np.repeat(start[:, None], size, axis=1))
        blocks = np.linspace(0, size // lanes, cores + 1).astype(int)

        def part(first: int, last: int) -> None:
            addresses = (padded.ctypes.data, instants.ctypes.data, state.ctypes.data)
            library.batch(*addresses, size, first, last, round(seconds / STEP), STEP)

        threads = [
            threading.Thread(target=part, args=(int(a), int(b)))
            for a, b in itertools.pairwise(blocks)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return state[:, :count]

    return call


def run_numpy(table: Array, start: Array, seconds: float) -> Array:
    """The final states (3, N) of the batch with vectorised NumPy."""
    state = np.repeat(start[:, None], table.shape[1], axis=1)
    return rk4(table, state, SWITCHED, STEP, round(seconds / STEP))


def run_library(
    plant: am.Plant,
    parameters: dict[str, Array],
    start: Array,
    seconds: float,
    cores: int,
    precision: Precision = Double(),
) -> Array:
    """The final states (3, N) of the batch with `simulate_batch`."""
    named = dict(zip((s.name for s in plant.states), start.tolist(), strict=True))
    solution = am.simulate_batch(
        plant,
        parameters,
        COMMAND,
        duration=seconds,
        initial_states=named,
        integrator=am.RungeKutta4(STEP),
        keep=(),
        cores=cores,
        precision=precision,
    )
    return np.array([solution.final[s.name] for s in plant.states])


def check_final_states(final_states: dict[str, Array], reference: str, nominal: Array) -> None:
    """Raise AssertionError if the final states of a variant differ from those of the reference."""
    for name, states in final_states.items():
        error = float((np.abs(states - final_states[reference]) / nominal[:, None]).max())
        limit = 1e-3 if "single" in name else 1e-9
        assert error < limit, (
            f"the final states of {name} and {reference} differ by {error:.1e} nominal values"
        )


def make_variants(
    folder: pathlib.Path, count: int, seconds: float
) -> dict[str, tuple[int, Callable[[], Array]]]:
    """The number of cores and the call of every variant."""
    plant, start = hanging(), runs()[3].vector
    parameters = random_parameters(plant, count)
    table = c_parameters(tree.unflatten(plant, list(parameters.values())), count)
    timed: dict[str, tuple[int, Callable[[], Array]]] = {}
    libraries = compile_libraries(folder)
    for cores in sorted({1, min(2, available_cores())}):
        suffix = f", {cores} cores" if cores > 1 else ""
        timed[f"simulate_batch{suffix}"] = (
            cores,
            lambda n=cores: run_library(plant, parameters, start, seconds, n),
        )
        for name, (library, lanes) in libraries.items():
            if cores == 1 or lanes == 32:
                run = make_c_batch(library, lanes, table, start, seconds)
                timed[f"{name}{suffix}"] = (cores, lambda run=run, n=cores: run(n))
    timed["simulate_batch, single precision"] = (
        1,
        lambda: run_library(plant, parameters, start, seconds, 1, Single()),
    )
    return timed


def measure_growth() -> list[tuple[str, ...]]:
    """Rows of the table: time over the number of plants, on one and on two cores."""
    plant, start, rows = hanging(), runs()[3].vector, []
    for count in GROWTH:
        parameters = random_parameters(plant, count)
        seconds = DURATION if count < 100_000 else DURATION / 5
        for cores in sorted({1, min(2, available_cores())}):
            batch = {
                "batch": lambda p=parameters, t=seconds, n=cores: run_library(plant, p, start, t, n)
            }
            rows.append(
                _row(
                    "simulate_batch, scaling",
                    count,
                    cores,
                    time_variants(batch, 2)["batch"],
                    seconds,
                )
            )
    return rows


def measure_equilibria(count: int, rounds: int) -> tuple[list[tuple[str, ...]], Target]:
    """Equilibria of the plants at ambient pressure: vectorised, as in `simulate_batch`, and one by
    one.
    """
    plant = hanging()
    different = variations_of(plant, random_parameters(plant, count), None)
    few = range(min(SINGLE_PLANTS, count))

    def vectorised() -> Array:
        return default_states(different, lambda done: None)[0]

    def one_by_one() -> Array:
        return np.array(
            [list(am.find_equilibrium(different.one(i), pressure=0.0).values()) for i in few]
        )

    check_final_states(
        {"one by one": one_by_one().T, "vectorised": vectorised()[: len(few)].T},
        "vectorised",
        runs()[3].nominal,
    )
    times = time_variants({"vectorised": vectorised, "one by one": one_by_one}, rounds)
    each = times["vectorised"].median / count
    size = f"{len(few)}"
    rows = [
        (
            "equilibria, vectorised",
            f"{count}",
            "1",
            *map(format_time, _median_and_minimum(times["vectorised"])),
            "",
        ),
        (
            "equilibria, one by one",
            size,
            "1",
            *map(format_time, _median_and_minimum(times["one by one"])),
            "",
        ),
    ]
    return rows, Target("equilibrium of a plant, vectorised, per plant", each * 1e6, 50.0, "us")


def _median_and_minimum(times: Times) -> tuple[float, float]:
    return times.median, times.minimum


def _row(
    name: str, count: int, cores: int, times: Times, seconds: float, factor: float = 1.0
) -> tuple[str, ...]:
    speed = count * seconds * factor / STEP / (times.median * factor) / 1e6
    shortened = f" ({seconds:g} s simulated)" if seconds != DURATION else ""
    durations = map(format_time, _median_and_minimum(times))
    return (f"{name}{shortened}", f"{count}", f"{cores}", *durations, f"{speed:.3g}")


def measure_memory() -> str:
    """Peak memory of a process that simulates 100 000 plants, minus that of a process that
    simulates 16.
    """
    code = (
        "import sys; from batch import *; plant = hanging(); n = int(sys.argv[1]);"
        " run_library(plant, random_parameters(plant, n), runs()[3].vector, 0.01,"
        f" 1){PRINT_PEAK_MEMORY}"
    )
    here = pathlib.Path(__file__).parent
    taken = [
        float(
            subprocess.run(
                [sys.executable, "-c", code, str(n)], cwd=here, check=True, capture_output=True
            ).stdout
        )
        for n in (16, 100_000)
    ]
    return f"{taken[1] - taken[0]:.0f} MB"


def section(rounds: int = 5, count: int = PLANTS, seconds: float = DURATION) -> Section:
    """The complete benchmark."""
    plant, start = hanging(), runs()[3].vector
    short = min(SHORT, seconds)
    with tempfile.TemporaryDirectory() as folder:
        timed = make_variants(pathlib.Path(folder), count, seconds)
        final_states = {name: call() for name, (_, call) in timed.items()}
        check_final_states(final_states, "simulate_batch", runs()[3].nominal)
        times = time_variants({name: call for name, (_, call) in timed.items()}, rounds)
        parameters = random_parameters(plant, count)
        table = c_parameters(tree.unflatten(plant, list(parameters.values())), count)
        slow = {"NumPy": lambda: run_numpy(table, start, short)}
        slow |= {"short": lambda: run_library(plant, parameters, start, short, 1)}
        by_numpy = time_variants(slow, max(2, rounds // 2))
    check_final_states(
        {"NumPy": slow["NumPy"](), "lanes": slow["short"]()}, "lanes", runs()[3].nominal
    )
    rows = [_row(name, count, timed[name][0], t, seconds) for name, t in times.items()]
    rows.append(_row("vectorised NumPy", count, 1, by_numpy["NumPy"], short))
    equilibrium_rows, equilibrium_target = measure_equilibria(count, rounds)
    rows += equilibrium_rows
    scaled = Times(tuple(t * seconds / short for t in by_numpy["NumPy"].rounds))
    targets = (*_bars(times, scaled), equilibrium_target)
    if (count, seconds) == (PLANTS, DURATION):
        rows += measure_growth()
        rows.append(
            (
                "memory for 100 000 plants, minus that for 16",
                "100000",
                "1",
                measure_memory(),
                "",
                "",
            )
        )
    return Section("Batch of 10 000 plants", TEXT, HEADER, tuple(rows), targets)


def _bars(times: dict[str, Times], numpy: Times) -> tuple[Target, ...]:
    ours = times["simulate_batch"]
    targets = []
    in_c32 = [n for n in times if n.startswith("C,") and n.endswith("32 lanes")]
    for wide, width in ((False, "default vector width"), (True, "maximum vector width")):
        named = [name for name in in_c32 if (WIDEST in name) == wide and "gcc" in name]
        if named:
            ratio = times[named[0]].ratio_to(ours)
            targets.append(
                Target(
                    f"C, gcc, 32 lanes, {width} / simulate_batch",
                    ratio,
                    LIMITS[""],
                    "x",
                    at_least=True,
                    reason=REASON,
                )
            )
    both = times.get("simulate_batch, 2 cores", ours)
    ratio = numpy.median / both.median
    targets.append(
        Target(
            "vectorised NumPy / simulate_batch, all cores",
            ratio,
            25.0,
            "x",
            at_least=True,
            reason=REASON,
        )
    )
    if "simulate_batch, 2 cores" in times:
        ratio = ours.ratio_to(times["simulate_batch, 2 cores"])
        targets.append(
            Target(
                "simulate_batch, 1 core / 2 cores",
                ratio,
                1.9,
                "x",
                at_least=True,
                reason=BUSY_REASON,
            )
        )
    ratio = ours.ratio_to(times["simulate_batch, single precision"])
    targets.append(
        Target("simulate_batch, double / single precision", ratio, 1.7, "x", at_least=True)
    )
    return tuple(targets)


if __name__ == "__main__":
    print_section(section_of_widths())
    print_section(section())
