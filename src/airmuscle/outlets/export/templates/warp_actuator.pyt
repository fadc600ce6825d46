@provenance@
"""@title@: a batched actuator for NVIDIA Warp, printed from a plant of airmuscle; it needs Warp and NumPy alone.

    actuator = @class@(4096 * 8, device="cpu")
    actuator.start(pressure=1e5, length=@length@)
    actuator.compute(command, length, speed, dt)      # Warp arrays (count,); writes actuator.tension, .pressure, .valid

The command [@unit@] is @command@, limited to COMMAND_RANGE; length [m] and speed [m/s] are those of the muscle. The
tension [N], the gauge pressure [Pa] and whether the point is within the validity range of the muscle belong to the
beginning of the step, the states to its end. The command is held over the step, the length moves at its speed; the
method is the classical one of Runge and Kutta with steps of at most STEP. The launches can be captured in a CUDA graph.

Where a command, length or speed is not finite, `valid` is 0, tension and pressure are NaN, and the states remain as they
are.
"""

import math

import numpy as np
import warp as wp

real = @real@

STATES = @states@
PARAMETERS = @parameters@
DEFAULTS = @defaults@
LOWER, UPPER = @lower@, @upper@
COMMAND_RANGE = (@low@, @high@)
RESTING_LENGTH = @length@
STEP = @step@
# Identified parameters, and the root of their covariance: deviations are SPREAD times independent normal deviates.
IDENTIFIED = @identified@
SPREAD = @spread@
NO_COVARIANCE = (
    "the parameters of this actuator have no covariance from which to draw; export a muscle file with a table"
    " [uncertainty], as `airmuscle campaign` writes it, or give drawn values to set_parameters"
)
HELD = @held@


@own_functions@


@functions@
@wp.kernel(enable_backward=False)
def gather(
    command: wp.array(dtype=real), length: wp.array(dtype=real), speed: wp.array(dtype=real), commands: wp.array2d(dtype=real),
    delay: wp.array(dtype=wp.int32), past: real, z: wp.array2d(dtype=real),
):
    """The inputs of a step that begins `past` [s] after the arguments; commands (max_delay + 1, count), newest first."""
    i = wp.tid()
    z[0, i] = command[i]
    if commands.shape[0] > 1:
        for row in range(commands.shape[0] - 1):
            k = commands.shape[0] - 1 - row
            if past == real(0.0):
                commands[k, i] = commands[k - 1, i]
        commands[0, i] = command[i]
        z[0, i] = commands[wp.clamp(delay[i], 0, commands.shape[0] - 1), i]
    z[1, i] = length[i] + past * speed[i]
    z[2, i] = speed[i]


class @class@:
    """`count` muscles of one kind with their circuits; all arrays are on `device` and keep their places.

    states (n, count); parameters (P, count); tension, pressure, valid: rows of `observed`; delay (count,) in steps
    """

    def __init__(self, count, *, max_delay=0, device=None):
        self.count, self.max_delay, self.device = count, max_delay, wp.get_device(device)
        self.parameters = self._array(len(PARAMETERS), np.broadcast_to(np.array(DEFAULTS)[:, None], (len(PARAMETERS), count)))
        self.prepared, self.states = self._array(HELD), self._array(len(STATES))
        self.observed, self._z, self._q = self._array(3), self._array(3), self._array(2)
        self.commands = self._array(max_delay + 1)
        self.delay = wp.full(count, max_delay, dtype=wp.int32, device=self.device)
        self.tension, self.pressure, self.valid = (self.observed[i] for i in range(3))
        self.prepare()

    @parameter_methods@

    def start(self, pressure=0.0, length=RESTING_LENGTH, command=0.0):
        """Begin at rest at gauge pressures [Pa] and lengths [m], after commands of this value."""
        self._q.assign(np.stack([np.broadcast_to(pressure, self.count), np.broadcast_to(length, self.count)]))
        self.commands.assign(np.broadcast_to(command, (self.max_delay + 1, self.count)))
        self._launch(start, self._q, self.prepared, self.states)

    def compute(self, command, length, speed, dt):
        """Write the outputs at the beginning of a step of `dt` [s], and advance the states.

        Raises ValueError for a `dt` that is not positive.
        """
        if not 0.0 < dt < math.inf:
            raise ValueError(f"dt is {dt} s; it must be positive and finite")
        steps = max(1, math.ceil(dt / STEP - 1e-9))
        for k in range(steps):
            self._launch(gather, command, length, speed, self.commands, self.delay, real(k * dt / steps), self._z)
            if k == 0:
                self._launch(observe, self.states, self._z, self.prepared, self.observed)
            self._launch(step, self.states, self._z, self.prepared, real(dt / steps), self.states)
