"""Loads of muscles in parallel on one point: masses, springs, constant forces, prescribed motion,
another program.
"""

from collections.abc import Sequence

from ...core import Input, ParameterError, Value, Values, model, parameter
from ...core.system import add_prefix
from .base import Mechanism, Translation, gravity_parameter

SHORTENING = "shortening"
SHORTENING_SPEED = "shortening_speed"
"""Names of the inputs of one muscle."""


@model
class Isometric(Mechanism):
    """Isometric load: constant contraction eps; the mechanism has no degree of freedom."""

    contraction: float = parameter(
        "1", "eps", "contraction at which the muscle is fixed", bounds=(-0.2, 0.9)
    )

    coordinates = ()

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(self.contraction for _ in resting_lengths)

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {}


@model
class Isotonic(Translation):
    """Isotonic load: m y'' = F - F_c - d y', with y from the position at the resting length of the
    muscle.

    The smaller the mass m, the closer the tension is to F_c. All muscles act on the same point in
    parallel.
    """

    force: float = parameter("N", "F_c", "constant force against the muscles", bounds=(0.0, 1e6))
    mass: float = parameter("kg", "m", "moving mass, without weight", bounds=(1e-4, 1e5))
    damping: float = parameter(
        "N s/m", "d", "damping coefficient of the load", bounds=(0.0, 1e6), default=0.0
    )

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {
            "position": (forces["position"] - self.force - self.damping * v["speed"]) / self.mass
        }

    def potential_energy(self, q: Values) -> Value:
        return self.force * q["position"]


@model
class HangingMass(Translation):
    """Hanging mass: m y'' = F - m g, with y upwards from the position at the resting length of the
    muscle.
    """

    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    gravity: float = gravity_parameter()

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {"position": forces["position"] / self.mass - self.gravity}

    def potential_energy(self, q: Values) -> Value:
        return self.mass * self.gravity * q["position"]


@model
class SpringLoad(Translation):
    """Spring load: m y'' = F - F_0 - k y - d y', with y from the position at the resting length of
    the muscle.

    The preload F_0 at y = 0 may include a weight m g. All muscles act on the same point in
    parallel.
    """

    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    stiffness: float = parameter("N/m", "k", "stiffness of the spring", bounds=(0.0, 1e8))
    damping: float = parameter(
        "N s/m", "d", "damping coefficient of the load", bounds=(0.0, 1e6), default=0.0
    )
    preload: float = parameter("N", "F_0", "preload at position 0", bounds=(-1e6, 1e6), default=0.0)

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        resistance = self.preload + self.stiffness * q["position"] + self.damping * v["speed"]
        return {"position": (forces["position"] - resistance) / self.mass}

    def potential_energy(self, q: Values) -> Value:
        return (self.preload + 0.5 * self.stiffness * q["position"]) * q["position"]


@model
class Pulley(Translation):
    """Stepped pulley: (J/r^2 + i^2 m) y'' = F - i m g - d y', with y from the position at the
    muscle's resting length.

    The drum on the load side has the radius i r, so that the mass m is lifted by i y; d is referred
    to the muscle. With i = 1 it only redirects the rope; i = 1/2 is also a block and tackle. All
    muscles act on one point in parallel.
    """

    radius: float = parameter(
        "m", "r", "radius of the drum on the muscle side", bounds=(1e-4, 10.0)
    )
    mass: float = parameter("kg", "m", "mass of the load", bounds=(1e-4, 1e5))
    ratio: float = parameter(
        "1", "i", "load displacement per muscle displacement", bounds=(1e-3, 1e3), default=1.0
    )
    inertia: float = parameter(
        "kg m^2", "J", "moment of inertia of the pulley", bounds=(0.0, 1e4), default=0.0
    )
    damping: float = parameter(
        "N s/m", "d", "viscous friction of the bearing", bounds=(0.0, 1e6), default=0.0
    )
    gravity: float = gravity_parameter()

    @property
    def total_inertia(self) -> Value:
        return self.inertia / self.radius**2 + self.ratio**2 * self.mass

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        resistance = self.ratio * self.mass * self.gravity + self.damping * v["speed"]
        return {"position": (forces["position"] - resistance) / self.total_inertia}

    def potential_energy(self, q: Values) -> Value:
        return self.mass * self.gravity * self.ratio * q["position"]


@model
class PrescribedMotion(Translation):
    """Prescribed motion: y'' = a(t), independent of the muscle forces; the drive absorbs the power
    F y'.

    y position relative to that at the resting length of the muscle, a the input. Input signals may
    be piecewise linear, so that y follows a cubic spline exactly:
    `airmuscle.engine.spline_trajectory` returns the acceleration signal and the initial state.
    """

    inputs = (
        Input(
            "prescribed_acceleration", "m/s^2", -1e5, 1e5, "acceleration prescribed by the drive"
        ),
    )

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {"position": inputs["prescribed_acceleration"]}

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        return forces["position"] * v["speed"]

    def kinetic_energy(self, q: Values, v: Values) -> Value:
        return 0.0


@model
class ExternalLoad(Mechanism):
    """Port to a load in another simulator: eps = s/L0 with the input s = L0 - L, and shortening
    speed v, an input too.

    A plant with this load has the causality of an actuator: shortening and its speed in, tension
    out; gas, valves, tubes, friction and series springs are inside. The speed that the caller gives
    must be the derivative of the shortening. The shortenings are coordinates outside the plant, on
    which the tensions act: the power F v that the load receives is part of the power that leaves
    the mechanism. `muscles` are the names before the inputs (`left.shortening`), none for a single
    muscle. `shortenings` are those at which a state is described without inputs, such as the
    initial state.
    """

    muscles: tuple[str, ...] = ()
    shortenings: tuple[float, ...] = parameter(
        "m",
        "s_i",
        "shortening of each muscle where no input is given",
        bounds=(-1e3, 1e3),
        fitted=False,
        default=(),
    )

    def check(self) -> None:
        if len(self.shortenings) not in (0, self.muscle_count):
            raise ParameterError(
                f"ExternalLoad: {len(self.shortenings)} shortenings are given for"
                f" {self.muscle_count} muscles; give one for each muscle, or none for their resting"
                " lengths."
            )

    coordinates = ()

    @property
    def muscle_count(self) -> int:
        return max(len(self.muscles), 1)

    @property
    def _prefixes(self) -> tuple[str, ...]:
        return tuple(f"{name}." for name in self.muscles) or ("",)

    @property
    def inputs(self) -> tuple[Input, ...]:
        own = (
            Input(SHORTENING, "m", -1e3, 1e3, "shortening from the resting length"),
            Input(SHORTENING_SPEED, "m/s", -1e3, 1e3, "derivative of the shortening"),
        )
        return tuple(each for prefix in self._prefixes for each in add_prefix(prefix, own))

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        given = self.shortenings or (0.0,) * len(resting_lengths)
        ports = zip(self._prefixes, given, resting_lengths, strict=True)
        return tuple(
            q.get(f"{prefix}{SHORTENING}", default) / length for prefix, default, length in ports
        )

    def contraction_speeds(
        self, q: Values, v: Values, resting_lengths: Sequence[Value]
    ) -> tuple[Value, ...]:
        return tuple(v.get(f"{prefix}{SHORTENING_SPEED}", 0.0) for prefix in self._prefixes)

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> Values:
        """Tension [N] of each muscle, by the name of its shortening."""
        return {
            f"{prefix}{SHORTENING}": tension
            for prefix, tension in zip(self._prefixes, tensions, strict=True)
        }

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {}

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        """Power [W] that the load outside receives: the sum of tension times shortening speed."""
        speeds = self.contraction_speeds({}, inputs, ())
        pulls = (forces[f"{prefix}{SHORTENING}"] for prefix in self._prefixes)
        return sum((pull * speed for pull, speed in zip(pulls, speeds, strict=True)), 0.0)
