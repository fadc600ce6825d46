"""Sizing of muscles for a lift or a joint: shortest muscles of a catalogue, ranked, and a scenario of the choice.

It is a package of its own between the library, whose entries it scales, and the reports that show its result. The
analysis of a given plant (equilibria, statics of a joint) is below the library and knows no catalogue.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
