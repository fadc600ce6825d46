"""`airmuscle hysteresis`: identification of friction models from hysteresis loops."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...bench.campaign import fit_held_creep, free_of_creep
from ...bench.campaign.campaign_chapters import creep_chapter
from ...bench.diagnosis.branch_residuals import delay_notes, find_delay
from ...bench.hysteresis import find_loops, fit_jointly, fit_loop, hysteresis_chapters
from ...bench.hysteresis.joint import select_friction
from ...bench.hysteresis.loops import CURVE_DEGREE
from ...core import check_writable
from ...files.library import Entry, load_law, model_class, part_toml, to_toml, without_parts
from ...physics import Friction
from ...physics.muscle.characteristic.base import ForceLaw
from ..requests import ReadingRequest, RequestError, Where, many, option, optional, request
from .delivery import deliver
from .measurements import Files, read_recordings, reading_chapters
from .options import Folder, Json
from .requested import with_requests
from .search_limit import SearchLimit
from .terminal import echo


def read_friction(name: str, where: str) -> type[Friction]:
    """The class of a friction law, by its name. Raises UnknownNameError or RequestError."""
    cls = model_class(name, where, kind=Friction)
    if not issubclass(cls, Friction):
        raise RequestError(f"{where}: {name} is no friction law.", "friction")
    return cls


@request
class HysteresisRequest:
    """What the fit of friction models is asked for."""

    muscle: str | None = optional(
        "Muscle to which the friction is added: a library entry or a muscle file."
    )
    use_characteristic: bool = option(
        "Take the muscle's characteristic plus an offset as the friction-free curve; default: a"
        " polynomial.",
        default=False,
    )
    degree: int = option(
        "Degree of the polynomial friction-free curve.", default=CURVE_DEGREE, bounds=(0, 9)
    )
    all_rows: bool = option(
        "Include rows in which pressure or length change quickly.", default=False
    )
    elements: int = option(
        "Number of elements of MaxwellSlip and PrandtlIshlinskii.", default=8, bounds=(1, 30)
    )
    friction: tuple[Any, ...] = many(
        "Law of yours that is fitted beside the others, 'module:Class'; needs --allow-code."
        " Repeatable.",
        metavar="NAME",
        read=read_friction,
    )
    creep: bool = option(
        "Fit creep to the longest hold of every file and write creep elements.", default=False
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for a characteristic without a muscle."""
        if self.use_characteristic and self.muscle is None:
            raise RequestError(f"{where('use_characteristic')} requires {where('muscle')}")


@with_requests
def hysteresis(
    files: Files,
    request: HysteresisRequest,
    reading: ReadingRequest,
    limit: SearchLimit,
    out: Folder = Path("hysteresis"),
    json: Json = False,
) -> None:
    """Fit friction models to hysteresis loops.

    \b
    The type of a run (isobaric, isometric) is detected; a second run at the same level validates
    the first. Statistical tests decide whether the data justify a friction model. Runs at several
    pressures are also fitted together, with a friction that depends on the pressure; a model that
    does not hold for all of them is not written. With --creep the holds after a motion give Maxwell
    elements, whose force is not taken for friction. Writes DIR/report.html. If a model that a plant
    can use is justified, it is written to DIR/muscle.toml (with --muscle) or to DIR/friction.toml,
    with the range of pressure and speed of the data; creep elements are written to the same
    DIR/muscle.toml, or to DIR/creep.toml.

    \b
    Examples:
      airmuscle hysteresis loop1.csv loop2.csv --resting-length "200 mm" --out friction
      airmuscle hysteresis loops/*.csv --muscle fit/muscle.toml --mapping rig.toml --creep
    """
    recordings = read_recordings(files, reading)
    entry = None if request.muscle is None else load_law(request.muscle)
    law = None if entry is None else entry.characteristic
    creep_fit = (
        fit_held_creep(recordings, law=law if isinstance(law, ForceLaw) else None)
        if request.creep
        else None
    )
    freed = recordings if creep_fit is None else free_of_creep(creep_fit.elements, recordings)
    curve = law if request.use_characteristic else None
    loops = find_loops(freed, law=curve, degree=request.degree, all_rows=request.all_rows)
    check_writable(out)
    progress = None if json else lambda name: echo(f"  {name}", err=True)
    elements = request.elements
    friction_laws = request.friction
    with limit.searches(None):
        fits = [
            fit_loop(loop, elements=elements, others=friction_laws, progress=progress)
            for loop in loops
        ]
        joint = fit_jointly(fits, progress=progress)
    selected = select_friction(fits, joint)
    chapters = hysteresis_chapters(fits, joint)
    if creep_fit is not None:
        chapters.append(
            creep_chapter(
                creep_fit.verdict,
                creep_fit.sentences,
                creep_fit.elements,
                creep_fit.standard_errors,
            )
        )
    notes = [*delay_notes(find_delay(recordings))]
    parts = list[tuple[str, Any, str, str]]()
    if selected is None:
        of_all = " for all runs together" if joint else ""
        notes.append(f"no friction file: no model that a plant can use is justified{of_all}")
    else:
        friction, source, verdict = selected
        parts.append(("friction", friction, verdict, f"Friction from {source}"))
    if creep_fit is not None and creep_fit.elements.stiffnesses:
        parts.append(("creep", creep_fit.elements, creep_fit.verdict, "Creep"))
    elif creep_fit is not None:
        notes.append("no creep elements are written")
    chapters[0] = dataclasses.replace(chapters[0], notes=(*chapters[0].notes, *notes))
    chapters += reading_chapters(recordings)
    deliver(
        "hysteresis", chapters, json=json, out=out, title="Friction", files=_files(entry, parts)
    )


def _files(entry: Entry | None, parts: Sequence[tuple[str, Any, str, str]]) -> dict[str, str]:
    """The file of the muscle with these parts (name, object, verdict, origin), or without one those
    of the parts.
    """
    if entry is None:
        return {
            f"{name}.toml": f"# {verdict}\n{part_toml(name, part)}"
            for name, part, verdict, _ in parts
        }
    if not parts:
        return {}
    changes = {name: part for name, part, *_ in parts}
    note = " ".join(
        (entry.note, *(f"{origin}: {verdict}" for *_, verdict, origin in parts))
    ).strip()
    uncertainty = entry.uncertainty and without_parts(entry.uncertainty, changes)
    completed = dataclasses.replace(
        entry, name="muscle", note=note, uncertainty=uncertainty, error_band=None, **changes
    )  # the band was stated without them; the checks are those of the characteristic alone
    return {"muscle.toml": to_toml(completed)}
