"""ode8 at 1e-4 s over 25 s (250 000 steps) compared with C code of the same equations."""

from __future__ import annotations

import ctypes
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
from filling import SPACING, Array, Run, lifting_run, stretch_factor
from measure import Section, Target, Times, format_time, print_section, time_variants
from rodas4 import kernel

import airmuscle as am
from airmuscle.engine.compile.program import compile_system

STEP = 1e-4
SOURCE = pathlib.Path(__file__).with_name("fill_discharge.c")
FLAGS = ("-O3", "-march=native")
FAST = "-ffast-math"
HEADER = (
    "muscles",
    "variant",
    "median",
    "minimum",
    "ratio to the fastest branch-free C",
    "maximum error [m]",
)
TEXT = (
    "One, two and six muscles on one mass, 2501 rows. The C code computes both valves and the"
    " surface with its extrapolation in every stage, without branches, and inlines a whole step;"
    " its fastest compiler and flags count. The library skips closed valves and the extrapolation"
    " beyond the validity range; a C variant with these branches is also listed. The reference is"
    " Rodas4 at rtol 1e-11."
)


def stages() -> str:
    """The stages after the first and the weighted sum of slopes as C macros, without zero
    coefficients.
    """
    rows, weights = am.DormandPrince8(STEP).tableau()

    def total(row: tuple[float, ...]) -> str:
        return " + ".join(f"{a!r} * k{i}[j]" for i, a in enumerate(row) if a)

    lines = [f"RATES({i}, {total(row)})" for i, row in enumerate(rows, 1)]
    return f"#define EXPLICIT_STAGES {' '.join(lines)}\n#define WEIGHTED {total(weights)}\n"


def constants(plant: am.Plant) -> Array:
    """The fields of the C struct `Plant`, in its order; the valves of a muscle differ only in
    conductance.
    """
    load = plant.mechanism
    muscles = [
        _constants(*pair, plant.ambient) for pair in zip(plant.muscles, plant.circuits, strict=True)
    ]
    return np.array([1 / load.mass, load.gravity, *(x for one in muscles for x in one)])


def _constants(muscle: am.Muscle, circuit: am.FillDischarge, ambient: am.Ambient) -> list[float]:
    law = muscle.contractile
    valve = circuit.fill
    k, c = stretch_factor(muscle.geometry)
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
    scaling = [x for low, high in validity_range for x in (low, 2 / (high - low))]
    return [
        *(
            1 / muscle.geometry.resting_length,
            k,
            c * c,
            am.physics.GAS_CONSTANT * ambient.temperature,
        ),
        *(ambient.pressure, am.physics.absolute_pressure(circuit.supply.pressure, ambient)),
        *(scale * v.conductance for v in (circuit.fill, circuit.discharge)),
        *(valve.critical_ratio, 1 / (1 - valve.critical_ratio), float(valve.laminar_slope())),
        *(*scaling, law.min_force, law.max_force),
        *(
            muscle.spring.stiffness,
            muscle.damper.damping,
            muscle.damper.damping_slope,
            *law.coefficients,
        ),
    ]


def make_c_run(
    run: Run, library: ctypes.CDLL, segments: am.engine.PiecewiseLinear | None = None
) -> Callable[[], Array]:
    """A function that computes the run, or given segments of it, with a compiled C library."""
    segments = segments or run.segments
    plant, start, inputs = constants(run.system), run.vector, np.ascontiguousarray(segments.values)
    steps = np.rint(np.diff([0.0, *segments.ends]) / STEP).astype(np.intc)
    if (steps % round(SPACING / STEP)).any():
        raise ValueError(
            "the C code writes rows every 10 ms; every switching time must be a multiple of 10 ms"
        )
    rows = np.empty((int(steps.sum()) * round(STEP * 1e6) // round(SPACING * 1e6) + 1, start.size))
    arguments = [
        plant.ctypes.data,
        start.ctypes.data,
        len(steps),
        steps.ctypes.data,
        inputs.ctypes.data,
    ]
    at = ctypes.c_void_p
    library.run_plant.argtypes = [at, at, ctypes.c_int, at, at, ctypes.c_double, ctypes.c_int, at]

    def call(keep: Any = (plant, start, inputs, steps)) -> Array:
        library.run_plant(*arguments, STEP, round(SPACING / STEP), rows.ctypes.data)
        return rows

    return call


def compilers() -> list[str]:
    """The available C compilers."""
    return [name for name in ("gcc", "clang") if shutil.which(name)]


def compile_libraries(folder: pathlib.Path, muscles: int = 1) -> dict[str, ctypes.CDLL]:
    """The C code compiled by each compiler, with and without -ffast-math, without and with
    branches.
    """
    source = folder / SOURCE.name
    source.write_text(stages() + SOURCE.read_text(encoding="utf-8"), encoding="utf-8")
    libraries = {}
    for compiler in compilers():
        for skip in ((), ("-DSKIP",)):
            for fast in ((), (FAST,)):
                name = " ".join(
                    ["C,", compiler, *FLAGS, *fast, *(["with branches"] if skip else [])]
                )
                target = folder / f"{muscles}-{len(libraries)}.so"
                compile_source(
                    [compiler, *FLAGS, *fast, *skip, f"-DMUSCLES={muscles}"], source, target
                )
                libraries[name] = ctypes.CDLL(str(target))
    return libraries


def compile_source(
    flags: list[str], source: pathlib.Path, target: pathlib.Path, linked: tuple[str, ...] = ("-lm",)
) -> None:
    """Compile and link a shared library.

    It is linked without -ffast-math, because gcc would add code that sets subnormals to zero in the
    whole process.
    """
    code = target.with_suffix(".o")
    compiler, *rest = flags
    subprocess.run([compiler, *rest, "-fPIC", "-c", str(source), "-o", str(code)], check=True)
    subprocess.run([compiler, *FLAGS, "-shared", str(code), "-o", str(target), *linked], check=True)


def measure(muscles: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Target, ...]]:
    """Rows and target for a plant with several muscles."""
    run = lifting_run(muscles)
    ready = compile_system(run.system)
    reference = kernel(run, ready, am.Rodas4(1e-11))()
    bound = am.DormandPrince8(STEP).bind(ready)
    segments = run.segments
    times = run.times
    state = run.vector
    library_name = "DormandPrince8(1e-4), kernel"
    variants: dict[str, Callable[[], Array]] = {
        library_name: lambda: bound.run(segments, 0.0, state, times).rows
    }
    with tempfile.TemporaryDirectory() as folder:
        libraries = compile_libraries(pathlib.Path(folder), muscles)
        variants |= {name: make_c_run(run, library) for name, library in libraries.items()}
        times_of = time_variants(variants, rounds)
        errors = {name: run.error(call(), reference) for name, call in variants.items()}
    branch_free = [
        name for name in variants if name != library_name and "with branches" not in name
    ]
    best = min(branch_free, key=lambda name: times_of[name].median, default=library_name)
    rows = tuple(
        (
            str(muscles),
            name,
            format_time(t.median),
            format_time(t.minimum),
            _times(t, times_of[best]),
            f"{errors[name]:.1e}",
        )
        for name, t in times_of.items()
    )
    title = f"muscles: {muscles}: ode8 / {best}"
    return rows, (
        (Target(title, times_of[library_name].ratio_to(times_of[best]), 1.15, "x"),)
        if branch_free
        else ()
    )


def _times(time: Times, other: Times) -> str:
    return f"{time.ratio_to(other):.3g}"


def section(rounds: int = 9) -> Section:
    """The complete benchmark."""
    parts = [measure(muscles, max(2, rounds // muscles)) for muscles in (1, 2, 6)]
    rows, targets = (
        tuple(x for part in column for x in part) for column in zip(*parts, strict=True)
    )
    return Section("ode8, 250 000 steps, compared with C", TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
