"""Sizing of muscles for a lift or a joint: shortest muscles of a catalogue, ranked, and a scenario
of the choice.
"""

from ...core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
