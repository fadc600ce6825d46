"""Equations of characteristics: expressions of a law, derived from its traced graph, in several notations."""

from .derivation import LawEquation, law_equation

__all__ = ["LawEquation", "law_equation"]
