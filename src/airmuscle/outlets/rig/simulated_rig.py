"""SimulatedRig: a plant of the library in place of a test rig."""

from collections.abc import Mapping

from ...core import RigError
from ...engine import Stepper
from ...physics import Plant


class SimulatedRig:
    """A rig whose muscles are a plant with set points; it advances by `sample_time` [s] at each
    reading.

    Readings are the pressures and the coordinates. `is_vented` is true until the first command and
    after `stop`; a vented rig holds all set points at 0.
    """

    def __init__(self, plant: Plant, sample_time: float) -> None:
        self.sample_time = sample_time
        self.is_vented = True
        self.commands = tuple(plant.inputs)
        coordinates = [coordinate.name for coordinate in plant.mechanism.coordinates]
        self.sensors = (*(f"{prefix}pressure" for prefix in plant.prefixes), *coordinates)
        self._stepper = Stepper(plant, plant.state_at(pressure=0.0))
        self._inputs = dict.fromkeys(self.commands, 0.0)

    def write(self, commands: Mapping[str, float]) -> None:
        """Set the gauge pressures [Pa] by name."""
        if set(commands) != set(self.commands):
            raise RigError(
                f"simulated rig: the commands are {', '.join(commands)}; it has"
                f" {', '.join(self.commands)}."
            )
        self.is_vented = False
        self._inputs = dict(commands)

    def read(self) -> dict[str, float]:
        """Advance by the sample time; the readings [SI] then."""
        return self.advance(self.sample_time)

    def advance(self, duration: float) -> dict[str, float]:
        """Advance by a time [s]; the readings [SI] then."""
        stepper = self._stepper
        stepper.step(self._inputs, duration)
        known = dict(zip(stepper.state_names, stepper.state.tolist(), strict=True))
        known |= dict(zip(stepper.output_names, stepper.outputs.tolist(), strict=True))
        readings = {}
        for name in self.sensors:
            readings[name] = known[name]
        return readings

    def stop(self) -> None:
        """Vent: all set points are 0 from now on."""
        self._inputs = dict.fromkeys(self.commands, 0.0)
        self.is_vented = True
