"""What a fit starts from: a library entry, a muscle file, or a law that the data themselves can start."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..library.entry import Entry
    from ..recording import Recording


class InitialLaw(NamedTuple):
    """An entry around the law, and the parameters that only multiply others and so stay."""

    entry: Entry
    fixed: tuple[str, ...] = ()


def start_of(name: str, recordings: Sequence[Recording], degree: int, option: str = "--characteristic") -> InitialLaw:
    """The library entry to start from, or a bare one around a law that starts from data alone."""
    from ..core.errors import ParameterError
    from ..identify.candidates import standard_candidates
    from ..library.catalogue import load_law
    from ..library.entry import Entry
    from ..library.models import model_class, model_names

    if name not in model_names():
        return InitialLaw(load_law(name))
    cls = model_class(name, option)
    if hasattr(cls, "blank"):
        # A clamp at twice what was measured cuts off no point, and still limits extrapolation.
        greatest = 2.0 * max(1.0, *(float(run["force"].max()) for run in recordings))
        return InitialLaw(Entry(name, name, "chosen", cls.blank(degree, max_force=greatest)))
    for candidate in standard_candidates(recordings):
        if type(candidate.law) is cls:
            return InitialLaw(Entry(name, name, "chosen", candidate.law), candidate.fixed)
    known = all("resting_length" in run.constants for run in recordings)
    length = "" if known else " or give the resting length, from which some laws can start,"
    raise ParameterError(
        f"{option}: {name} needs values to start from. Name a library entry made of it (airmuscle list shows which),"
        f"{length} or write a muscle file with your own."
    )
