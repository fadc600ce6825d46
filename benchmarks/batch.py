"""Many plants at once, every parameter of each its own: lanes against C of the same equations and vectorised NumPy."""

from __future__ import annotations

import ctypes
import itertools
import pathlib
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from batch_numpy import rk4
from filling import Array, hanging, runs
from measure import PEAK, Bar, Section, Times, interleaved, of_time, show
from ode8 import compilers

from airmuscle.analysis.equilibrium import find_equilibrium
from airmuscle.control.inputs import Schedule
from airmuscle.core import tree
from airmuscle.plant.plant import Plant
from airmuscle.pneumatics.gas import GAS_CONSTANT, REFERENCE_DENSITY, REFERENCE_TEMPERATURE
from airmuscle.simulation.batch import Double, Precision, Single, simulate_batch
from airmuscle.simulation.batch.initial_states import resting_starts
from airmuscle.simulation.batch.thread_pool import cores_here
from airmuscle.simulation.batch.variations import variations_of
from airmuscle.simulation.integrators import RungeKutta4

STEP, PLANTS, DURATION = 1e-3, 10_000, 5.0
SHORT = 0.1
"""Simulated time [s] of the NumPy variant, whose steps all cost the same; its time is scaled to DURATION."""
SOURCE = pathlib.Path(__file__).with_name("batch.c")
FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd")
WIDEST = "-mprefer-vector-width=512"
SPREAD = 0.05
COMMAND = Schedule({"fill": ((0.5, 1.0), (2.0, 0.0)), "discharge": ((3.0, 1.0), (4.0, 0.0))})
SWITCHED = (0.5, 2.0, 3.0, 4.0)
FEW = 20
"""Plants that are asked one by one where they rest."""
GROWTH = (1, 100, 1000, 10_000, 100_000)
HEADING = ("variant", "plants", "cores", "median", "least", "million plant-steps a second")
TEXT = (
    "The plant of three states with its 44 parameters drawn anew for every plant, within 5 % (chosen), RK4 at "
    "1e-3 s over 5 s, the end of each kept. The C computes the same equations in blocks of 8, 16 or 32 lanes, "
    "everything that depends on parameters alone computed before; `simulate_batch` is timed whole, with the check "
    f"of every parameter. Of NumPy, which uses one core, {SHORT:g} s are run and counted as 5 s. The C has no "
    "branch; the library goes around shut valves and the tangent of a validity range not left, where that holds for all "
    "plants of a register row, as it does here. All these start at one state; where each of the plants rests "
    "at ambient pressure is what a batch without a start asks first."
)
WHY = (
    "both sides are bound by the same multiplications, roots and quotients; the library skips shut valves and a "
    "tangent that no plant of a register row needs, and pays for the check of every parameter"
)
BUSY = "measured while others used the machine, two threads share what one had; to be measured again on a quiet one"


def varied(plant: Plant, count: int) -> dict[str, Array]:
    """Every parameter of the plant within SPREAD of its value and its bounds, by its path."""
    rng = np.random.default_rng(5)
    found = {}
    for leaf in tree.leaves(plant):
        values = leaf.value * (1 + SPREAD * rng.uniform(-1, 1, count))
        found[leaf.path] = np.clip(values, *leaf.declared.bounds)
    return found


def constants(plant: Any, count: int) -> Array:
    """The parameters (46, N) of the C source, in its order."""
    muscle, circuit, load, ambient = plant.muscles[0], plant.circuits[0], plant.mechanism, plant.ambient
    law, (k, c) = muscle.contractile, _stretch(muscle.geometry)
    scale = REFERENCE_DENSITY * np.sqrt(REFERENCE_TEMPERATURE / ambient.temperature)
    validity_range = (law.min_contraction, law.max_contraction), (law.min_pressure, law.max_pressure)
    valves = [
        x
        for v in (circuit.fill, circuit.discharge)
        for x in (scale * v.conductance, v.critical_ratio, 1 / (1 - v.critical_ratio), v.laminar_slope())
    ]
    rows = [1 / load.mass, load.gravity, 1 / muscle.geometry.resting_length, k, c * c]
    rows += [GAS_CONSTANT * ambient.temperature, ambient.pressure, circuit.supply.pressure + ambient.pressure, *valves]
    rows += [x for low, high in validity_range for x in (low, 2 / (high - low))]
    rows += [law.min_force, law.max_force, muscle.spring.stiffness, muscle.damper.damping, muscle.damper.damping_slope]
    return np.array([np.broadcast_to(row, count) for row in (*rows, *law.coefficients)])


def _stretch(braid: Any) -> tuple[Array, Array]:
    return (
        np.pi * braid.radius**2 * braid.resting_length / np.sin(braid.braid_angle) ** 2,
        np.cos(braid.braid_angle),
    )


def compiled(folder: pathlib.Path) -> dict[str, tuple[ctypes.CDLL, int]]:
    """The C source by each compiler, for several lanes, with the compiler's own width of vectors and the widest."""
    found = {}
    for compiler in compilers():
        for wide in ((), (WIDEST,)):
            for lanes in (8, 16, 32):
                name = " ".join(["C,", compiler, *FLAGS[:3], *wide, f"{lanes} lanes"])
                target = folder / f"batch{len(found)}.so"
                code = target.with_suffix(".o")
                subprocess.run(
                    [compiler, *FLAGS, *wide, f"-DLANES={lanes}", "-fPIC", "-c", str(SOURCE), "-o", str(code)],
                    check=True,
                )
                subprocess.run([compiler, "-shared", str(code), "-o", str(target)], check=True)
                found[name] = ctypes.CDLL(str(target)), lanes
    return found


def in_c(library: ctypes.CDLL, lanes: int, parameters: Array, start: Array, seconds: float) -> Callable[[int], Array]:
    """The batch by a compiled C library on so many threads; ends (3, N)."""
    count, size = parameters.shape[1], -(-parameters.shape[1] // lanes) * lanes
    given = np.ascontiguousarray(np.pad(parameters, ((0, 0), (0, size - count)), mode="edge"))
    at = np.ascontiguousarray(np.repeat(np.array(SWITCHED)[:, None], size, axis=1))
    pointer, whole = ctypes.c_void_p, ctypes.c_long
    library.batch.argtypes = [pointer, pointer, pointer, whole, whole, whole, whole, ctypes.c_double]

    def call(cores: int) -> Array:
        state = np.ascontiguousarray(np.repeat(start[:, None], size, axis=1))
        blocks = np.linspace(0, size // lanes, cores + 1).astype(int)

        def part(first: int, last: int) -> None:
            addresses = (given.ctypes.data, at.ctypes.data, state.ctypes.data)
            library.batch(*addresses, size, first, last, round(seconds / STEP), STEP)

        threads = [threading.Thread(target=part, args=(int(a), int(b))) for a, b in itertools.pairwise(blocks)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return state[:, :count]

    return call


def in_numpy(table: Array, start: Array, seconds: float) -> Array:
    """The batch over arrays of all plants; ends (3, N)."""
    state = np.repeat(start[:, None], table.shape[1], axis=1)
    return rk4(table, state, SWITCHED, STEP, round(seconds / STEP))


def in_lanes(
    plant: Plant,
    parameters: dict[str, Array],
    start: Array,
    seconds: float,
    cores: int,
    precision: Precision = Double(),
) -> Array:
    """The batch by `simulate_batch`; ends (3, N)."""
    named = dict(zip((s.name for s in plant.states), start.tolist(), strict=True))
    found = simulate_batch(
        plant, parameters, COMMAND, duration=seconds, start=named, method=RungeKutta4(STEP), keep=(), cores=cores,
        precision=precision,
    )  # fmt: skip
    return np.array([found.final[s.name] for s in plant.states])


def refuse_other_ends(ends: dict[str, Array], reference: str, nominal: Array) -> None:
    """Raise AssertionError where a variant ends elsewhere than the reference does."""
    for name, found in ends.items():
        error = float((np.abs(found - ends[reference]) / nominal[:, None]).max())
        limit = 1e-3 if "single" in name else 1e-9
        assert error < limit, f"{name} ends {error:.1e} nominal sizes from {reference}"


def variants(folder: pathlib.Path, count: int, seconds: float) -> dict[str, tuple[int, Callable[[], Array]]]:
    """What is timed: the number of cores, and the call."""
    plant, start = hanging(), runs()[3].vector
    parameters = varied(plant, count)
    table = constants(tree.unflatten(plant, list(parameters.values())), count)
    found: dict[str, tuple[int, Callable[[], Array]]] = {}
    libraries = compiled(folder)
    for cores in sorted({1, min(2, cores_here())}):
        of = f", {cores} cores" if cores > 1 else ""
        found[f"simulate_batch{of}"] = (cores, lambda n=cores: in_lanes(plant, parameters, start, seconds, n))
        for name, (library, lanes) in libraries.items():
            if cores == 1 or lanes == 32:
                run = in_c(library, lanes, table, start, seconds)
                found[f"{name}{of}"] = (cores, lambda run=run, n=cores: run(n))
    found["simulate_batch, single precision"] = (1, lambda: in_lanes(plant, parameters, start, seconds, 1, Single()))
    return found


def growth() -> list[tuple[str, ...]]:
    """How the cost grows with the number of plants, on one core and on two; and the memory that it takes."""
    plant, start, rows = hanging(), runs()[3].vector, []
    for count in GROWTH:
        parameters, seconds = varied(plant, count), DURATION if count < 100_000 else DURATION / 5
        for cores in sorted({1, min(2, cores_here())}):
            times = interleaved({"": lambda p=parameters, t=seconds, n=cores: in_lanes(plant, p, start, t, n)}, 2)[""]
            rows.append(_row("simulate_batch, growth", count, cores, times, seconds))
    return rows


def rests(count: int, rounds: int) -> tuple[list[tuple[str, ...]], Bar]:
    """Where each plant rests at ambient pressure, as `simulate_batch` asks where no start is given, and one by one."""
    plant = hanging()
    different = variations_of(plant, varied(plant, count), None)
    few = range(min(FEW, count))

    def together() -> Array:
        return resting_starts(different, lambda done: None)[0]

    def alone() -> Array:
        return np.array([list(find_equilibrium(different.one(i), pressure=0.0).values()) for i in few])

    refuse_other_ends({"alone": alone().T, "together": together()[: len(few)].T}, "together", runs()[3].nominal)
    times = interleaved({"together": together, "alone": alone}, rounds)
    each, size = times["together"].median / count, f"{len(few)}"
    rows = [
        ("where each rests, all at once", f"{count}", "1", *map(of_time, _ends(times["together"])), ""),
        ("where each rests, one by one", size, "1", *map(of_time, _ends(times["alone"])), ""),
    ]
    return rows, Bar("where a plant rests, found with the others", each * 1e6, 50.0, "us")


def _ends(times: Times) -> tuple[float, float]:
    return times.median, times.least


def _row(name: str, count: int, cores: int, times: Times, seconds: float, factor: float = 1.0) -> tuple[str, ...]:
    speed = count * seconds * factor / STEP / (times.median * factor) / 1e6
    shortened = f" ({seconds:g} s simulated)" if seconds != DURATION else ""
    return (f"{name}{shortened}", f"{count}", f"{cores}", of_time(times.median), of_time(times.least), f"{speed:.3g}")


def memory() -> str:
    """The greatest memory of a process that simulates 100 000 plants, above that of one that simulates 16."""
    code = (
        "import sys; from batch import *; plant = hanging(); n = int(sys.argv[1]); "
        f"in_lanes(plant, varied(plant, n), runs()[3].vector, 0.01, 1){PEAK}"
    )
    here = pathlib.Path(__file__).parent
    taken = [
        float(subprocess.run([sys.executable, "-c", code, str(n)], cwd=here, check=True, capture_output=True).stdout)
        for n in (16, 100_000)
    ]
    return f"{taken[1] - taken[0]:.0f} MB"


def section(rounds: int = 5, count: int = PLANTS, seconds: float = DURATION) -> Section:
    """All of it."""
    plant, start = hanging(), runs()[3].vector
    short = min(SHORT, seconds)
    with tempfile.TemporaryDirectory() as folder:
        timed = variants(pathlib.Path(folder), count, seconds)
        ends = {name: call() for name, (_, call) in timed.items()}
        refuse_other_ends(ends, "simulate_batch", runs()[3].nominal)
        times = interleaved({name: call for name, (_, call) in timed.items()}, rounds)
        parameters = varied(plant, count)
        table = constants(tree.unflatten(plant, list(parameters.values())), count)
        slow = {"NumPy": lambda: in_numpy(table, start, short)}
        slow |= {"short": lambda: in_lanes(plant, parameters, start, short, 1)}
        by_numpy = interleaved(slow, max(2, rounds // 2))
    refuse_other_ends({"NumPy": slow["NumPy"](), "lanes": slow["short"]()}, "lanes", runs()[3].nominal)
    rows = [_row(name, count, timed[name][0], t, seconds) for name, t in times.items()]
    rows.append(_row("vectorised NumPy", count, 1, by_numpy["NumPy"], short))
    of_rests, quick = rests(count, rounds)
    rows += of_rests
    scaled = Times(tuple(t * seconds / short for t in by_numpy["NumPy"].rounds))
    bars = (*_bars(times, scaled), quick)
    if (count, seconds) == (PLANTS, DURATION):
        rows += growth()
        rows.append(("memory for 100 000 plants, beyond that for 16", "100000", "1", memory(), "", ""))
    return Section("10 000 plants at once", TEXT, HEADING, tuple(rows), bars)


def _bars(times: dict[str, Times], numpy: Times) -> tuple[Bar, ...]:
    ours, bars = times["simulate_batch"], []
    in_c32 = [n for n in times if n.startswith("C,") and n.endswith("32 lanes")]
    for wide, what in ((False, "gcc's own width of vectors"), (True, "the widest vectors")):
        named = [name for name in in_c32 if (WIDEST in name) == wide and "gcc" in name]
        if named:
            ratio = times[named[0]].ratio_to(ours)
            bars.append(Bar(f"C, 32 lanes, {what} / simulate_batch", ratio, 1.1, "x", at_least=True, why=WHY))
    both = times.get("simulate_batch, 2 cores", ours)
    ratio = numpy.median / both.median
    bars.append(Bar("vectorised NumPy / simulate_batch, all cores", ratio, 25.0, "x", at_least=True, why=WHY))
    if "simulate_batch, 2 cores" in times:
        ratio = ours.ratio_to(times["simulate_batch, 2 cores"])
        bars.append(Bar("simulate_batch, 1 core / 2 cores", ratio, 1.9, "x", at_least=True, why=BUSY))
    return tuple(bars)


if __name__ == "__main__":
    show(section())
