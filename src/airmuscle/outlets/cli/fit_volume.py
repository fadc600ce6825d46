"""`airmuscle fit-volume`: the volume of a muscle from a water column or from fills."""

import contextlib
import dataclasses
from pathlib import Path

from ...bench.statics import fit_volume, volume_points
from ...core import ParameterError, PhysicsError, check_writable
from ...files.library import list_files, load_law, part_toml, resting_lengths, to_toml
from ...physics.muscle.characteristic import ValidityRange, maxwell_defect, validity_range_of
from ..requests import ReadingRequest, check_one_length
from ..requests.declaration import option, optional, request
from .delivery import deliver
from .measurements import Files, read_recordings, reading_chapters
from .options import Folder, Json
from .requested import with_requests


@request
class VolumeRequest:
    """What the fit of a volume is asked for."""

    muscle: str | None = optional("Muscle whose geometry is replaced, for the Maxwell defect.")
    temperature: float = option(
        "Temperature of the air at both ends of a fill.", unit="K", default="293.15 K"
    )


@with_requests
def fit_volume_command(
    files: Files,
    request: VolumeRequest,
    reading: ReadingRequest,
    out: Folder = Path("volume"),
    json: Json = False,
) -> None:
    """Fit the volume of a muscle over its contraction.

    \b
    FILES are of a water column (volume over contraction or length) or of fills at held lengths
    (pressure, and air_mass or mass_flow). Of a braid and polynomials, the law chosen by AICc is
    written, with its standard deviation. With --muscle, DIR/muscle.toml is the muscle with this
    volume, and the Maxwell defect dF/dp + dV/dL is stated.

    \b
    Examples:
      airmuscle fit-volume column.csv --resting-length "200 mm" --out volume
      airmuscle fit-volume fills/*.csv --muscle fit/muscle.toml --out volume
    """
    entry = None if request.muscle is None else load_law(request.muscle)
    check_writable(out)
    recordings = read_recordings(files, reading)
    points = volume_points(recordings, request.temperature)
    lengths = resting_lengths(recordings)
    entry_length = getattr(getattr(entry, "geometry", None), "resting_length", None)
    deviating = (
        []
        if entry_length is None
        else [
            length_of_data
            for length_of_data in lengths
            if abs(length_of_data - entry_length) > 1e-6
        ]
    )
    if entry is not None and deviating:
        raise ParameterError(
            f"the resting length of the data is {deviating[0]:.4g} m, that of {entry.name}"
            f" {entry_length:.4g} m. Correct one of them."
        )
    length = (
        float(entry_length)
        if entry_length is not None and not lengths
        else check_one_length(lengths, "a muscle")
    )
    fit = fit_volume(points, length)
    if entry is None:
        chapter = fit.chapter(f"Volume fitted to {list_files([f.stem for f in files])}")
        contents = {"geometry.toml": part_toml("geometry", fit.geometry)}
    else:
        law = entry.characteristic
        limits = None
        defect = None
        stated = validity_range_of(law, entry.validity_range)
        data = fit.points.contraction
        if stated is not None:  # within the contractions of the data
            low = max(stated.min_contraction, float(data.min()))
            high = min(stated.max_contraction, float(data.max()))
            limits = (
                ValidityRange(stated.min_pressure, stated.max_pressure, low, high)
                if low < high
                else None
            )
        with contextlib.suppress(PhysicsError):  # slack everywhere
            defect = None if limits is None else maxwell_defect(law, fit.geometry, limits)
        chapter = fit.chapter(entry.title, None if limits is None else law, limits, defect)
        note = f"Volume fitted to {list_files([f.name for f in files])}: {fit.summary}."
        fitted = dataclasses.replace(
            entry,
            name="muscle",
            geometry=fit.geometry,
            provenance="fitted",
            note=" ".join(filter(None, (entry.note, note))),
            checks=(),
        )
        contents = {"muscle.toml": to_toml(fitted)}
    chapters = [chapter, *reading_chapters(recordings)]
    deliver("fit-volume", chapters, json=json, out=out, title="Volume", files=contents)
