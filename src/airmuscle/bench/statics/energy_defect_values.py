"""Maxwell defect of a law with the volume of its muscle, as values of a chapter."""

from ...physics.muscle.characteristic.energy_defect import EnergyDefect
from ...report.chapter import NamedValue


def defect_values(defect: EnergyDefect) -> list[NamedValue]:
    """The Maxwell defect and its place; it is zero where force and volume derive from one
    potential.
    """
    return [
        NamedValue(
            "Maxwell defect", defect.worst, defect.unit, remark=f"|dF/dp + dV/dL| {defect.place}"
        ),
        NamedValue(
            "relative Maxwell defect", defect.relative, "1", "%", remark="of the maximum of -dV/dL"
        ),
    ]
