"""Runs of the benchmarks: 25 s on plants with three, six, eight and ten states.

Three states: a Hill-type muscle with a surface of 21 coefficients, two MATRIX valves and a hanging
mass, with filling and discharge as in the third paper. Conductance and critical ratio of the valve,
supply, gas and schedule are those of the paper (Hošovský et al.); surface, spring, damper and mass
are chosen. Eight states: six such muscles in parallel. Six and ten states: `joints.py`.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import numpy.typing as npt
from joints import joint, joint_start

import airmuscle as am
from airmuscle.core import ops
from airmuscle.core.system import System

Array = npt.NDArray[np.float64]
DURATION = 25.0
SPACING = 0.01
BRAID = am.geometry.Braid(0.01, 0.4363, 0.3)
BOX = ((-1e4, 6e5), (-0.05, 0.35))
"""Validity range of the surface: gauge pressure [Pa] and contraction [1]. It starts below ambient
pressure, so that a muscle at rest is inside and the compared codes need no extrapolation there."""
FILL_DISCHARGE = am.Schedule({"fill": ((5.0, 1.0), (15.0, 0.0)), "discharge": ((19.0, 1.0),)})
JOINT_PULSES = am.Schedule(
    {
        "left.fill": ((2.0, 1.0), (2.05, 0.0)),
        "right.discharge": ((2.0, 1.0), (2.05, 0.0)),
        "left.discharge": ((10.0, 1.0), (10.08, 0.0)),
        "right.fill": ((10.0, 1.0), (10.08, 0.0)),
    }
)


def measured_force(pressure: Array, contraction: Array) -> Array:
    """Force [N] of a synthetic muscle: Tondu and Lopez (2000), end correction decreasing with
    pressure (chosen).

    F = pi r_0^2 p (a (1 - k(p) eps)^2 - b),   a = 3/tan^2(theta_0),   b = 1/sin^2(theta_0)
    """
    a = 3 / np.tan(BRAID.braid_angle) ** 2
    b = 1 / np.sin(BRAID.braid_angle) ** 2
    end_correction = 1.25 + 0.6 * np.exp(-pressure / 1.5e5)
    return np.asarray(
        np.pi * BRAID.radius**2 * pressure * (a * (1 - end_correction * contraction) ** 2 - b)
    )


@functools.cache
def surface() -> am.characteristic.ContractileSurface:
    """The polynomial of degree five fitted to `measured_force` on a grid over its validity
    range.
    """
    blank = am.characteristic.ContractileSurface.blank().with_validity_range(*BOX)
    p, eps = (grid.ravel() for grid in np.meshgrid(*(np.linspace(*ends, 41) for ends in BOX)))
    columns = np.column_stack([np.asarray(c) for c in blank.basis(p, eps)])
    coefficients = np.linalg.lstsq(columns, measured_force(p, eps))[0]
    return dataclasses.replace(blank, coefficients=tuple(coefficients.tolist()))


def hanging(muscles: int = 1) -> am.Plant:
    """Muscles in parallel on one mass, each with two valves and a different stiffness: one state
    per muscle, and two.

    One muscle gives the plant with three states.
    """
    matrix = am.Valve(2.6167e-9, 0.433)
    supply = am.Supply(650e3 - am.Ambient().pressure)
    each = [
        am.Muscle(
            surface(),
            BRAID,
            am.LinearSpring(4000.0 + 50.0 * i),
            am.physics.PressureDamper(100.0, 5e-4),
            name=f"muscle{i}",
        )
        for i in range(muscles)
    ]
    circuits = (am.FillDischarge(supply, matrix, matrix),) * muscles
    if muscles == 1:
        return am.Plant(each[0], circuits[0], am.HangingMass(5.0), am.Isothermal())
    return am.Plant(tuple(each), circuits, am.HangingMass(5.0 * muscles), am.Isothermal())


def staggered_schedule(plant: am.Plant) -> am.Schedule:
    """The schedule of the third paper for the first muscle, delayed by 0.2 s for each further
    muscle.
    """
    changes = {}
    for i, prefix in enumerate(plant.prefixes):
        for name, instants in FILL_DISCHARGE.changes.items():
            changes[f"{prefix}{name}"] = tuple((time + 0.2 * i, value) for time, value in instants)
    return am.Schedule(changes)


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """A system with initial state and input signal; `lever` converts its coordinate to a
    displacement [m].
    """

    system: System
    initial_state: dict[str, float]
    command: am.Schedule
    coordinate: str
    lever: float

    @property
    def vector(self) -> Array:
        return np.array([self.initial_state[s.name] for s in self.system.states])

    @property
    def nominal(self) -> Array:
        return np.array([s.nominal for s in self.system.states])

    @property
    def segments(self) -> am.engine.PiecewiseLinear:
        return self.command.segments(self.system.inputs, 0.0, DURATION)

    @property
    def times(self) -> Array:
        """Output times [s], every 10 ms; they contain all switching times."""
        return np.linspace(0.0, DURATION, round(DURATION / SPACING) + 1)

    def error(self, rows: Array, reference: Array) -> float:
        """Maximum error of the displacement [m] over the run; rows are (N, n)."""
        index = [s.name for s in self.system.states].index(self.coordinate)
        return float(self.lever * np.abs(rows[:, index] - reference[:, index]).max())


@functools.cache
def lifting_run(muscles: int) -> Run:
    """The run of the plant with several muscles on one mass."""
    plant = hanging(muscles)
    return Run(
        plant,
        dict(am.find_equilibrium(plant, pressure=0.0)),
        staggered_schedule(plant),
        "position",
        1.0,
    )


@functools.cache
def runs() -> dict[int, Run]:
    """The runs by number of states: 3, one muscle; 6 and 10, a joint with two muscles; 8, six
    muscles on one mass.
    """
    six = joint()
    ten = joint(heat=True)
    return {
        3: lifting_run(1),
        6: Run(six, joint_start(six), JOINT_PULSES, "angle", six.radius),
        8: lifting_run(6),
        10: Run(ten, joint_start(ten), JOINT_PULSES, "angle", ten.radius),
    }


def stretch_factor(braid: am.geometry.Braid) -> tuple[float, float]:
    """k and c of the volume V = k s (1 - (c s)^2), s = 1 - eps, for hand-written equations."""
    k = ops.pi * braid.radius**2 * braid.resting_length / ops.sin(braid.braid_angle) ** 2
    return float(k), float(ops.cos(braid.braid_angle))
