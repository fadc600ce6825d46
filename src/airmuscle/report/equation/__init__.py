"""Equations of characteristics: the recorded expression of a law, simplified and grouped for
reading, in several notations.

SymPy 1.14 was tried in place of the forms and notations here, for the 17 laws of the tests. It
takes 0.3 s to import and 85 MB. It writes sums, products and the arguments of a maximum in an order
of its own and not in that of the law, merges numbers such as pi and the sum over the fibres, and
has no notation for Excel or for arrays in MATLAB. Monomials, validity range, names of shared parts
and both of these notations would remain.
"""

from .derivation import LawEquation, law_equation

__all__ = ["LawEquation", "law_equation"]
