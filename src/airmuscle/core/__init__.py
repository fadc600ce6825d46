"""Foundations: models and parameters, parameter trees, numeric and symbolic operators, errors, references, units."""

from . import ops, plotting, tree
from .arrays import Array
from .declaration import Parameter, model, parameter, parameters
from .reference import Reference, cite
from .system import SensitivitySystem, System
from .tree import Leaf, flatten, leaves, structure, unflatten, with_parameters
from .variables import Input, StateVariable

__all__ = [
    "Array",
    "Input",
    "Leaf",
    "Parameter",
    "Reference",
    "SensitivitySystem",
    "StateVariable",
    "System",
    "cite",
    "flatten",
    "leaves",
    "model",
    "ops",
    "parameter",
    "parameters",
    "plotting",
    "structure",
    "tree",
    "unflatten",
    "with_parameters",
]
