"""Force of a muscle along a recorded motion: its law, with friction and creep of the motion."""

from typing import Any

import numpy as np

from ...core import Array
from ...physics import CreepElements
from ...physics.muscle.friction import Friction, NoFriction
from ...recording import Recording
from ..inspection import estimate_noise
from ..statics import evaluate_force

MAX_ROWS = 1000
"""Maximum number of rows of a record for a fit of friction (chosen)."""
PREDICTED_ROWS = 3000
"""Maximum number of rows of a record for which the friction is computed (chosen)."""
NOISE_STEPS = 4.0
DEAD_BAND = 4.0
"""Mean step of the displacement between two rows, and half width of the dead band of a motion, in
standard deviations of the noise (chosen)."""


def thinned_rows(size: int, count: int) -> Array:
    """The numbers of at most `count` rows of `size`, evenly spaced."""
    return np.unique(np.linspace(0, size - 1, min(count, size)).round().astype(int))


def displacement(recording: Recording) -> Array:
    """Displacement eps L0 [m] at every row, shape (N,)."""
    return np.asarray(recording["contraction"] * float(recording.constants["resting_length"]))


def path_rows(recording: Recording, max_rows: int = MAX_ROWS) -> Array:
    """The numbers of at most `max_rows` rows that follow the motion without that of the noise."""
    path = displacement(recording)
    noise = estimate_noise(path)
    span = float(np.ptp(path))
    count = (
        max_rows
        if noise == 0.0
        else int(min(max_rows, max(2.0 * span / (NOISE_STEPS * noise), 20)))
    )
    return thinned_rows(len(recording), count)


def held_steady(path: Array, noise: float) -> Array:
    """The motion without its noise: the output of a play operator, which rests while the path [m]
    stays within a dead band of `DEAD_BAND` standard deviations of the noise [m]; shape (N,). The
    noise of a held length would otherwise unload the friction: cycles within the presliding
    distance relax the force of most friction laws towards zero.
    """
    if noise == 0.0:
        return path
    half = DEAD_BAND * noise
    output = np.empty(path.size)
    current = float(path[0])
    for i, value in enumerate(path.tolist()):
        current = min(max(current, value - half), value + half)
        output[i] = current
    return output


def friction_along(friction: Friction, recording: Recording) -> Array:
    """Friction force against contraction [N] along the motion of a recording, relaxed at its start;
    shape (N,). It is computed at rows whose steps are beyond the noise of the displacement, and
    interpolated between them. The motion is that outside a dead band of the noise, so that a held
    length keeps its friction."""
    if isinstance(friction, NoFriction):
        return np.zeros(len(recording))
    rows = path_rows(recording, PREDICTED_ROWS)
    time = recording.columns.get("time")
    path = displacement(recording)
    path = held_steady(path[rows], estimate_noise(path))
    force = np.asarray(friction.force_along(path, None if time is None else time[rows]))
    factor = np.asarray(friction.pressure_factor(recording["pressure"][rows]))
    return np.asarray(np.interp(np.arange(len(recording)), rows, factor * force))


def creep_stretches(time: Array, path: Array, relaxation_times: Array) -> Array:
    """Stretch z [m] of each Maxwell element along a path x [m], z' = x' - z/tau, exact for linear
    motion; (N, E).
    """
    steps = np.diff(path, prepend=path[:1])
    durations = np.diff(time, prepend=time[:1])
    decay = np.exp(-durations[:, None] / relaxation_times)
    ratio = durations[:, None] / relaxation_times
    gain = (
        np.where(ratio > 1e-9, -np.expm1(-ratio) / np.maximum(ratio, 1e-300), 1.0) * steps[:, None]
    )
    stretches = np.zeros((time.size, relaxation_times.size))
    for i in range(1, time.size):
        stretches[i] = stretches[i - 1] * decay[i] + gain[i]
    return stretches


def creep_force(elements: CreepElements, recording: Recording) -> Array:
    """Force of the elements against contraction [N] along the motion of a recording, relaxed at its
    start; (N,).
    """
    if not elements.stiffnesses or "time" not in recording:
        return np.zeros(len(recording))
    stretches = creep_stretches(
        recording["time"], displacement(recording), np.array(elements.relaxation_times)
    )
    return np.asarray(stretches @ np.array(elements.stiffnesses))


def has_path(recording: Recording) -> bool:
    """Whether a recording has the displacement over time."""
    return "time" in recording and isinstance(
        recording.constants.get("resting_length"), float | int
    )


def predicted_force(
    law: Any, recording: Recording, friction: Friction, creep: CreepElements, max_force: float
) -> Array:
    """The force [N] along the pressure and the motion of a recording, negative where the muscle is
    slack; shape (N,). Friction and creep, relaxed at the first row, are left out without the
    constant `resting_length`. `max_force` [N] limits the force of laws that give contraction or
    pressure. Raises ColumnError."""
    force = evaluate_force(law, recording["pressure"], recording["contraction"], max_force)
    if recording.constants.get("resting_length") is None:
        return force
    return force - friction_along(friction, recording) - creep_force(creep, recording)
