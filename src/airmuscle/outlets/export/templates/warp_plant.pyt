@provenance@
"""@title@: a batched joint or arm with its muscles for NVIDIA Warp, printed from a plant of airmuscle; it needs Warp and
NumPy alone.

    arm = @class@(4096, device="cpu")
    arm.start(pressure=1e5, angle=0.0)
    arm.compute(command, dt)      # Warp array (@inputs_count@, count); writes arm.angle, .speed, .pressure, .tension, .valid

The rows of a command are @commands@, each limited to its COMMAND_RANGES. Coordinates and speeds (J, count), gauge pressures
[Pa] and tensions [N] (M, count) and whether the point is within the validity range of the muscles belong to the beginning
of the step, the states to its end. The commands are held over the step; the method is the classical one of Runge and Kutta
with steps of at most STEP. The launches can be captured in a CUDA graph.

Where a command is not finite, `valid` is 0, the other outputs are NaN, and the states remain as they are.
"""

import math

import numpy as np
import warp as wp

real = @real@

STATES = @states@
COMMANDS = @names@
COMMAND_RANGES = @ranges@
COORDINATES = @coordinates@
MUSCLES = @muscles@
PARAMETERS = @parameters@
DEFAULTS = @defaults@
LOWER, UPPER = @lower@, @upper@
STEP = @step@
# Identified parameters, and the root of their covariance: deviations are SPREAD times independent normal deviates.
IDENTIFIED = @identified@
SPREAD = @spread@
NO_COVARIANCE = (
    "the parameters of this plant have no covariance from which to draw; export a scenario with a table [uncertainty], as"
    " `airmuscle fit-joint` writes it, or give drawn values to set_parameters"
)
HELD = @held@


@own_functions@


@functions@
@wp.kernel(enable_backward=False)
def advance(x: wp.array2d(dtype=real), f: wp.array2d(dtype=real), h: real, y: wp.array2d(dtype=real)):
    """y = x + h f, with rows of states and elements of the batch."""
    k, i = wp.tid()
    y[k, i] = x[k, i] + h * f[k, i]


class @class@:
    """`count` plants of one kind; all arrays are on `device` and keep their places.

    states (n, count); parameters (P, count); angle, speed, pressure, tension, valid: rows of `observed`
    """

    def __init__(self, count, *, device=None):
        self.count, self.device = count, wp.get_device(device)
        self.parameters = self._array(len(PARAMETERS), np.broadcast_to(np.array(DEFAULTS)[:, None], (len(PARAMETERS), count)))
        self.prepared, self.states = self._array(HELD), self._array(len(STATES))
        joints, muscles = len(COORDINATES), len(MUSCLES)
        self.observed, self._q = self._array(2 * joints + 2 * muscles + 1), self._array(muscles + joints)
        self._rates, self._moved, self._next = (self._array(len(STATES)) for _ in range(3))
        self.angle, self.speed = self.observed[:joints], self.observed[joints : 2 * joints]
        forces = 2 * joints + muscles
        self.pressure, self.tension = self.observed[2 * joints : forces], self.observed[forces : forces + muscles]
        self.valid = self.observed[forces + muscles]
        self.prepare()

    @parameter_methods@

    def start(self, pressure=0.0, angle=0.0):
        """Begin at rest at gauge pressures [Pa] of the muscles and at coordinates: numbers, or arrays (rows, count)."""
        joints, muscles = len(COORDINATES), len(MUSCLES)
        begun = np.broadcast_to(pressure, (muscles, self.count)), np.broadcast_to(angle, (joints, self.count))
        self._q.assign(np.concatenate(begun))
        self._launch(start, self._q, self.prepared, self.states)

    def _advance(self, begin, h, end):
        shape = (len(STATES), self.count)
        wp.launch(advance, dim=shape, inputs=(begin, self._rates, real(h), end), device=self.device)

    def compute(self, command, dt):
        """Write the outputs at the beginning of a step of `dt` [s], and advance the states.

        Raises ValueError for a `dt` that is not positive.
        """
        if not 0.0 < dt < math.inf:
            raise ValueError(f"dt is {dt} s; it must be positive and finite")
        self._launch(observe, self.states, command, self.prepared, self.observed)
        steps = max(1, math.ceil(dt / STEP - 1e-9))
        h = dt / steps
        for _ in range(steps):
            wp.copy(self._next, self.states)
            point = self.states
            for part, weight in ((0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)):
                self._launch(rates, point, command, self.prepared, self._rates)
                self._advance(self._next, weight * h / 6.0, self._next)
                if part:
                    self._advance(self.states, part * h, self._moved)
                    point = self._moved
            wp.copy(self.states, self._next)
