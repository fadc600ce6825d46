"""ode8 at 1e-4 s over 25 s against MuJoCo's RK4 with the same muscles as C callbacks, compiled here."""

from __future__ import annotations

import ctypes
import importlib.util
import pathlib
import shutil
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
from filling import SPACING, Array, Run, lifts
from measure import Bar, Section, interleaved, of_time, show
from ode8 import FLAGS, SOURCE, STEP, build, compilers, constants
from rodas4 import kernel

from airmuscle.compile.program import compile_system
from airmuscle.plant.plant import Plant
from airmuscle.simulation.integrators import DormandPrince8, Integrator, Rodas4, RungeKutta4

CALLBACKS = pathlib.Path(__file__).with_name("mujoco_callbacks.c")
HEADING = ("muscles", "variant", "median", "least", "times ode8", "greatest error [m]")
TEXT = (
    "A mass on a vertical slide without collisions; a muscle is an actuator whose activation is its air. `mj_step` is "
    "told to take all steps between two rows in one call. Its callbacks are C that skips shut valves and the tangent "
    "beyond the validity range. RungeKutta4 is the method that MuJoCo has, too; Rodas4 is what the library takes unless told "
    "otherwise."
)
WHY = (
    "ode8 has 13 stages, RK4 has 4; MuJoCo's own work, most of its time with one muscle, hardly grows with the "
    "muscles, so that with more of them the stages decide. Its error at this step is as small as that of ode8; "
    "RungeKutta4, which is MuJoCo's method, and Rodas4 stand beside"
)
BODY = """<mujoco><option timestep="{step!r}" integrator="RK4" gravity="0 0 {gravity!r}"><flag contact="disable"
constraint="disable"/></option><worldbody><body><joint name="lift" type="slide" axis="0 0 1"/>
<geom type="sphere" size="0.05" mass="{mass!r}"/></body></worldbody><actuator>{actuators}</actuator></mujoco>"""
ACTUATOR = '<general joint="lift" dyntype="user" gaintype="user" biastype="user"/>'


def absent() -> str:
    """Why this cannot be measured here; empty where it can."""
    if importlib.util.find_spec("mujoco") is None:
        return "mujoco is not installed and left out: pip install mujoco."
    return "" if compilers() else "No C compiler is on the path, so that MuJoCo's callbacks are left out."


def body(plant: Plant, step: float) -> str:
    """The plant for MuJoCo, in its own language; position is upwards, as ours."""
    load = plant.mechanism
    return BODY.format(
        step=step, gravity=-load.gravity, mass=load.mass, actuators=ACTUATOR * len(plant.muscles)
    )  # fmt: skip


def callbacks(folder: pathlib.Path, muscles: int) -> ctypes.CDLL:
    """The compiled callbacks, linked with the MuJoCo that Python has."""
    import mujoco

    home = pathlib.Path(mujoco.__file__).parent
    (library,) = [path for path in home.iterdir() if path.name.startswith("libmujoco.")]
    for source in (SOURCE, CALLBACKS):
        shutil.copy(source, folder)
    compiler, target = compilers()[0], folder / f"callbacks{muscles}.so"
    chosen = [f"-I{home / 'include'}", f"-DMUSCLES={muscles}", "-DSKIP"]
    linked = (str(library), f"-Wl,-rpath,{home}", "-lm")
    build([compiler, *FLAGS, "-ffast-math", *chosen], folder / CALLBACKS.name, target, linked)
    return ctypes.CDLL(str(target))


def in_mujoco(run: Run, library: ctypes.CDLL, step: float = STEP) -> Callable[[], Array]:
    """The run by MuJoCo's RK4."""
    import mujoco

    plant, inputs = constants(run.system), np.ascontiguousarray(run.segments.values)
    model = mujoco.MjModel.from_xml_string(body(run.system, step))  # before the callbacks: it calls them, too
    counts = np.rint(np.diff([0.0, *run.segments.ends]) / SPACING).astype(int)
    rows, every = np.empty((counts.sum() + 1, run.vector.size)), round(SPACING / step)
    library.hold.argtypes = library.open_valves.argtypes = [ctypes.c_void_p]

    def call(keep: Any = (plant, inputs)) -> Array:
        data, row = mujoco.MjData(model), 0
        data.act[:], data.qpos[0], data.qvel[0] = run.vector[:-2], run.vector[-2], run.vector[-1]
        rows[0] = run.vector
        library.hold(plant.ctypes.data)
        library.install()
        for openings, count in zip(inputs, counts, strict=True):
            library.open_valves(openings.ctypes.data)
            for _ in range(count):
                mujoco.mj_step(model, data, every)
                row += 1
                rows[row, :-2], rows[row, -2:] = data.act, (data.qpos[0], data.qvel[0])
        library.remove_all()
        return rows

    return call


def measure(muscles: int, rounds: int) -> tuple[tuple[tuple[str, ...], ...], tuple[Bar, ...]]:
    """Rows and the bar of so many muscles on one mass."""
    run = lifts(muscles)
    ready = compile_system(run.system)
    reference = kernel(run, ready, Rodas4(1e-11))()
    segments, times, state = run.segments, run.times, run.vector
    ours, theirs = "DormandPrince8(1e-4), kernel", "MuJoCo RK4(1e-4), C callbacks"

    def by(method: Integrator) -> Callable[[], Array]:
        return lambda: method.run(ready, segments, 0.0, state, times).rows

    variants = {ours: by(DormandPrince8(STEP))}
    variants |= {"RungeKutta4(1e-4), kernel": by(RungeKutta4(STEP)), "Rodas4(1e-6), kernel": by(Rodas4(1e-6))}
    with tempfile.TemporaryDirectory() as folder:
        library = callbacks(pathlib.Path(folder), muscles)
        variants[theirs] = in_mujoco(run, library)
        variants["MuJoCo RK4(1e-3), C callbacks"] = in_mujoco(run, library, 1e-3)
        taken = interleaved(variants, rounds)
        errors = {name: run.error(call(), reference) for name, call in variants.items()}
    rows = tuple(
        (
            str(muscles),
            name,
            of_time(t.median),
            of_time(t.least),
            f"{t.ratio_to(taken[ours]):.3g}",
            f"{errors[name]:.1e}",
        )
        for name, t in taken.items()
    )
    what = f"muscles: {muscles}: MuJoCo RK4 with C callbacks / ode8, both 250 000 steps"
    return rows, (Bar(what, taken[theirs].ratio_to(taken[ours]), 12.0, "x", at_least=True, why=WHY),)


def section(rounds: int = 5) -> Section:
    """The whole comparison."""
    title = "ode8, 250 000 steps, against MuJoCo"
    if absent():
        return Section(title, absent(), HEADING, ())
    parts = [measure(muscles, max(1, rounds // muscles)) for muscles in (1, 2, 6)]
    rows, bars = (tuple(x for part in column for x in part) for column in zip(*parts, strict=True))
    return Section(title, TEXT, HEADING, rows, bars)


if __name__ == "__main__":
    show(section())
