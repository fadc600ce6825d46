"""ode8 at 1e-4 s over 25 s compared with RK4 of MuJoCo, with the same muscles as compiled C
callbacks.
"""

from __future__ import annotations

import ctypes
import importlib.util
import pathlib
import shutil
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
from filling import SPACING, Array, Run, lifting_run
from measure import Section, Target, format_time, print_section, time_variants
from ode8 import FLAGS, SOURCE, STEP, compile_source, compilers, constants
from rodas4 import kernel

import airmuscle as am
from airmuscle.engine.compile.program import compile_system

CALLBACKS = pathlib.Path(__file__).with_name("mujoco_callbacks.c")
HEADER = ("muscles", "variant", "median", "minimum", "ratio to ode8", "maximum error [m]")
STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
"""Steps [s] of the comparison at equal error, which divide the spacing of the rows."""
ERROR_LIMIT = 1e-6
"""Maximum error of the position [m] in the comparison at equal error (chosen)."""
TEXT = (
    "A mass on a vertical slide joint without contacts; a muscle is an actuator whose activation"
    " is its air mass. One call of `mj_step` takes all steps between two output times. The"
    " callbacks are C code that skips closed valves and the extrapolation beyond the validity"
    " range. RungeKutta4 is the method of MuJoCo; Rodas4 is the default of the library. The"
    " targets compare at equal error: each method takes its coarsest step of"
    f" {', '.join(f'{step * 1e3:g}' for step in STEPS)} ms whose position error is at most"
    f" {ERROR_LIMIT * 1e6:g} um."
)
BODY = """<mujoco><option timestep="{step!r}" integrator="RK4" gravity="0 0 {gravity!r}"><flag contact="disable"
constraint="disable"/></option><worldbody><body><joint name="lift" type="slide" axis="0 0 1"/>
<geom type="sphere" size="0.05" mass="{mass!r}"/></body></worldbody><actuator>{actuators}</actuator></mujoco>"""  # noqa: E501
ACTUATOR = '<general joint="lift" dyntype="user" gaintype="user" biastype="user"/>'


def missing_note() -> str:
    """The reason why this benchmark cannot be run; empty if it can."""
    if importlib.util.find_spec("mujoco") is None:
        return "Omitted, because mujoco is not installed: pip install mujoco."
    return (
        ""
        if compilers()
        else "Omitted, because there is no C compiler for the callbacks of MuJoCo."
    )


def model_xml(plant: am.Plant, step: float) -> str:
    """The plant as a MuJoCo model (MJCF); the position is positive upwards, as in the library."""
    load = plant.mechanism
    return BODY.format(
        step=step, gravity=-load.gravity, mass=load.mass, actuators=ACTUATOR * len(plant.muscles)
    )


def compile_callbacks(folder: pathlib.Path, muscles: int) -> ctypes.CDLL:
    """The compiled callbacks, linked with the MuJoCo library of the Python package."""
    import mujoco

    home = pathlib.Path(mujoco.__file__).parent
    (library,) = [path for path in home.iterdir() if path.name.startswith("libmujoco.")]
    for source in (SOURCE, CALLBACKS):
        shutil.copy(source, folder)
    compiler = compilers()[0]
    target = folder / f"callbacks{muscles}.so"
    options = [f"-I{home / 'include'}", f"-DMUSCLES={muscles}", "-DSKIP"]
    linked = (str(library), f"-Wl,-rpath,{home}", "-lm")
    compile_source(
        [compiler, *FLAGS, "-ffast-math", *options], folder / CALLBACKS.name, target, linked
    )
    return ctypes.CDLL(str(target))


def make_mujoco_run(run: Run, library: ctypes.CDLL, step: float = STEP) -> Callable[[], Array]:
    """A function that computes the run with RK4 of MuJoCo."""
    import mujoco

    plant, inputs = constants(run.system), np.ascontiguousarray(run.segments.values)
    model = mujoco.MjModel.from_xml_string(
        model_xml(run.system, step)
    )  # before the callbacks are installed, because this calls them too
    counts = np.rint(np.diff([0.0, *run.segments.ends]) / SPACING).astype(int)
    rows, every = np.empty((counts.sum() + 1, run.vector.size)), round(SPACING / step)
    library.hold.argtypes = library.open_valves.argtypes = [ctypes.c_void_p]

    def call(keep: Any = (plant, inputs)) -> Array:
        data = mujoco.MjData(model)
        row = 0
        data.act[:] = run.vector[:-2]
        data.qpos[0] = run.vector[-2]
        data.qvel[0] = run.vector[-1]
        rows[0] = run.vector
        library.hold(plant.ctypes.data)
        library.install()
        for openings, count in zip(inputs, counts, strict=True):
            library.open_valves(openings.ctypes.data)
            for _ in range(count):
                mujoco.mj_step(model, data, every)
                row += 1
                rows[row, :-2] = data.act
                rows[row, -2:] = (data.qpos[0], data.qvel[0])
        library.remove_all()
        return rows

    return call


def measure(muscles: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Target, ...]]:
    """Rows and target for a plant with several muscles on one mass."""
    run = lifting_run(muscles)
    ready = compile_system(run.system)
    reference = kernel(run, ready, am.Rodas4(1e-11))()
    segments = run.segments
    times = run.times
    state = run.vector
    library_name = "DormandPrince8(1e-4), kernel"
    mujoco_name = "MuJoCo RK4(1e-4), C callbacks"

    def kernel_call(method: am.engine.Integrator) -> Callable[[], Array]:
        bound = method.bind(ready)
        return lambda: bound.run(segments, 0.0, state, times).rows

    variants = {library_name: kernel_call(am.DormandPrince8(STEP))}
    variants |= {
        "RungeKutta4(1e-4), kernel": kernel_call(am.RungeKutta4(STEP)),
        "Rodas4(1e-6), kernel": kernel_call(am.Rodas4(1e-6)),
    }
    with tempfile.TemporaryDirectory() as folder:
        library = compile_callbacks(pathlib.Path(folder), muscles)
        variants[mujoco_name] = make_mujoco_run(run, library)
        coarsest = {
            kind: coarsest_step(make, run, reference)
            for kind, make in {
                "MuJoCo": lambda step: make_mujoco_run(run, library, step),
                "RungeKutta4": lambda step: kernel_call(am.RungeKutta4(step)),
                "DormandPrince8": lambda step: kernel_call(am.DormandPrince8(step)),
            }.items()
        }
        for kind, (step, call) in coarsest.items():
            variants[f"{kind}, coarsest step, {step * 1e3:g} ms"] = call
        times_of = time_variants(variants, rounds)
        errors = {name: run.error(call(), reference) for name, call in variants.items()}
    rows = tuple(
        (
            str(muscles),
            name,
            format_time(t.median),
            format_time(t.minimum),
            f"{t.ratio_to(times_of[library_name]):.3g}",
            f"{errors[name]:.1e}",
        )
        for name, t in times_of.items()
    )
    names = {
        kind: f"{kind}, coarsest step, {step * 1e3:g} ms" for kind, (step, _) in coarsest.items()
    }
    best = min(
        (names["RungeKutta4"], names["DormandPrince8"]), key=lambda name: times_of[name].median
    )
    target = (
        f"muscles: {muscles}: MuJoCo RK4 with C callbacks / fixed step of the library, at equal"
        " error"
    )
    return rows, (
        Target(
            target, times_of[names["MuJoCo"]].ratio_to(times_of[best]), 12.0, "x", at_least=True
        ),
    )


def coarsest_step(
    make: Callable[[float], Callable[[], Array]], run: Run, reference: Array
) -> tuple[float, Callable[[], Array]]:
    """The longest step whose error is within the limit, and the run with it."""
    for step in STEPS:
        call = make(step)
        if run.error(call(), reference) <= ERROR_LIMIT:
            return step, call
    raise SystemExit(f"no step of {STEPS} s has an error of {ERROR_LIMIT} m or less")


def section(rounds: int = 5) -> Section:
    """The complete benchmark."""
    title = "ode8, 250 000 steps, compared with MuJoCo"
    if missing_note():
        return Section(title, missing_note(), HEADER, ())
    parts = [measure(muscles, max(1, rounds // muscles)) for muscles in (1, 2, 6)]
    rows, targets = (
        tuple(x for part in column for x in part) for column in zip(*parts, strict=True)
    )
    return Section(title, TEXT, HEADER, rows, targets)


if __name__ == "__main__":
    print_section(section())
