"""`airmuscle fit` and `airmuscle fit-volume`: a characteristic or a volume law identified from measurement files."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from ...bench.identify.volume_fit import VolumeFit, fit_volume, volume_chapter, volume_points, volume_summary
from ...core import ParameterError, PhysicsError, check_writable
from ...files.library import Entry, list_files, load_law, part_toml, resting_lengths, to_toml
from ...physics.muscle.characteristic import EnergyDefect, ValidityRange, maxwell_defect, validity_range_of
from ...recording import Recording
from ..requests import FitRequest, ReadingRequest, RequestError, check_one_length, fit_requested, option, request
from .bench_files import Files, read_recordings, reading_chapters
from .delivery import deliver
from .execution import Execution
from .options import Folder, Json, with_requests
from .terminal import computation_progress


@with_requests
def fit(
    files: Files, request: FitRequest, reading: ReadingRequest, execution: Execution, out: Folder = Path("fit"),
    json: Json = False,
) -> None:  # fmt: skip
    """Fit a characteristic to measured points, or compare several.

    \b
    Writes DIR/muscle.toml, which every command accepts as NAME, and DIR/report.html with figures and data.
    FILES may also be data sets of the library (see airmuscle list).

    \b
    Examples:
      airmuscle fit bench.csv --characteristic ContractileSurface --resting-length "300 mm" --out fit
      airmuscle fit bench.csv --characteristic ContractileSurface --braid "radius=10 mm, angle=24.4 deg"
      airmuscle fit bench.csv --characteristic dmsp-20-300 --unit pressure=bar --fix wall_thickness
      airmuscle fit dmsp-20-300 --characteristic ContractileSurface --degree 4 --robust "10 N"
      airmuscle fit runs/*.csv --characteristic dmsp-20-300 --bootstrap 1000 --profile weak
      airmuscle fit bench.csv --characteristic ContractileSurface --shape --free-contraction "3 bar=18 %"
      airmuscle fit runs/*.xlsx --mapping rig.toml --compare --leave-out run
      airmuscle fit muscles/*.csv --mapping rig.toml --compare --purpose both --length-error "20 cm"
      airmuscle fit muscles/*.csv --mapping rig.toml --compare --join /shared/fit    (on each machine)
      airmuscle fit log_held*.csv --file-name "held{length [mm]}mm" --time uniform --resting-length "200 mm" --compare
      airmuscle evaluate fit/muscle.toml --pressure "3 bar" --force "100 N"
    """
    if execution.requested and not (request.compare or request.bootstrap):
        raise RequestError(
            "--workers, --dask and --join distribute the candidates of --compare and the refits of --bootstrap"
        )
    recordings = read_recordings(files, reading)
    writes = execution.writes(out)
    progress = computation_progress("comparison" if request.compare else "fit")
    with execution.executor() as executor, progress as show:
        found = fit_requested(request, files, recordings, lambda _, fraction: show(fraction), executor)
    muscle = {"muscle.toml": to_toml(found.entry)}
    writes = writes or execution.takes_over(out)
    deliver("fit", found.chapters, json=json, out=out, title="Fit", files=muscle, writes=writes)


@request
class VolumeRequest:
    """What the fit of a volume is asked for."""

    muscle: str | None = option("Muscle whose geometry is replaced, for the Maxwell defect.", default=None)
    temperature: float = option("Temperature of the air at both ends of a fill.", unit="K", default="293.15 K")


@with_requests
def fit_volume_command(
    files: Files, request: VolumeRequest, reading: ReadingRequest, out: Folder = Path("volume"), json: Json = False
) -> None:
    """Fit the volume of a muscle over its contraction.

    \b
    FILES are of a water column (volume over contraction or length) or of fills at held lengths (pressure, and
    air_mass or mass_flow). Of a braid and polynomials, the law chosen by AICc is written, with its standard deviation.
    With --muscle, DIR/muscle.toml is the muscle with this volume, and the Maxwell defect dF/dp + dV/dL is stated.

    \b
    Examples:
      airmuscle fit-volume column.csv --resting-length "200 mm" --out volume
      airmuscle fit-volume fills/*.csv --muscle fit/muscle.toml --out volume
    """
    entry = None if request.muscle is None else load_law(request.muscle)
    check_writable(out)
    recordings = read_recordings(files, reading)
    fit = fit_volume(volume_points(recordings, request.temperature), _length(recordings, entry))
    limits = None if entry is None else _limits(entry, fit)
    defect = None if entry is None or limits is None else _defect(entry, fit, limits)
    title, law = f"Volume fitted to {list_files([f.stem for f in files])}", None
    contents = {"geometry.toml": part_toml("geometry", fit.geometry)}
    if entry is not None:
        fitted = _entry(entry, fit, files)
        title, law = fitted.title, None if limits is None else entry.characteristic
        contents = {"muscle.toml": to_toml(fitted)}
    chapters = [volume_chapter(fit, title, law, limits, defect), *reading_chapters(recordings)]
    deliver("fit-volume", chapters, json=json, out=out, title="Volume", files=contents)


def _length(recordings: Sequence[Recording], entry: Entry | None) -> float:
    """The resting length [m] of the data, otherwise of the muscle; both must agree. Raises ParameterError."""
    lengths = resting_lengths(recordings)
    own = getattr(entry.geometry, "resting_length", None) if entry is not None else None
    if own is not None and any(abs(length - own) > 1e-6 for length in lengths):
        raise ParameterError(
            f"the resting length of the data is {lengths[0]:.4g} m, that of {entry.name if entry else ''} {own:.4g} m. "
            "Correct one of them."
        )
    if not lengths and own is not None:
        return float(own)
    if len(lengths) != 1:
        check_one_length(lengths)
    return float(lengths[0])


def _limits(entry: Entry, fit: VolumeFit) -> ValidityRange | None:
    """The validity range of the force law within the contractions of the data; None if there is none."""
    stated = validity_range_of(entry.characteristic, entry.validity_range)
    if stated is None:
        return None
    low = max(stated.min_contraction, float(fit.points.contraction.min()))
    high = min(stated.max_contraction, float(fit.points.contraction.max()))
    return ValidityRange(stated.min_pressure, stated.max_pressure, low, high) if low < high else None


def _defect(entry: Entry, fit: VolumeFit, limits: ValidityRange) -> EnergyDefect | None:
    try:
        return maxwell_defect(entry.characteristic, fit.geometry, limits)
    except PhysicsError:  # slack everywhere
        return None


def _entry(entry: Entry, fit: VolumeFit, files: list[Path]) -> Entry:
    note = f"Volume fitted to {list_files([f.name for f in files])}: {volume_summary(fit)}."
    return dataclasses.replace(entry, name="muscle", geometry=fit.geometry, provenance="fitted",
                               note=" ".join(filter(None, (entry.note, note))), checks=())  # fmt: skip
