"""Sizing of muscles for a lift or a joint: shortest muscles of a catalogue, ranked, and a scenario of the choice.

It is a package of its own between the library, whose entries it scales, and the reports that show its result. The
analysis of a given plant (equilibria, statics of a joint) is below the library and knows no catalogue.
"""

from .choice import (
    SORT_KEYS,
    MuscleChoice,
    MuscleDesign,
    Requirement,
    UnsuitableMuscle,
    by_air,
    by_count,
    by_diameter,
    by_length,
    by_reserve,
)
from .requirement import JointRequirement, LiftRequirement, SizingConditions
from .scenario import scenario_text
from .search import SizingResult, catalogue, choose, size_muscles
from .sizing_chapter import choice_row
from .static_muscle import EndPoint, StaticMuscle
from .valve_sizing import discharge_valve, fill_valve

__all__ = [
    "SORT_KEYS",
    "EndPoint",
    "JointRequirement",
    "LiftRequirement",
    "MuscleChoice",
    "MuscleDesign",
    "Requirement",
    "SizingConditions",
    "SizingResult",
    "StaticMuscle",
    "UnsuitableMuscle",
    "by_air",
    "by_count",
    "by_diameter",
    "by_length",
    "by_reserve",
    "catalogue",
    "choice_row",
    "choose",
    "discharge_valve",
    "fill_valve",
    "scenario_text",
    "size_muscles",
]
