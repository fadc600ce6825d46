"""`airmuscle fit-volume`: volume law of a muscle from a water column or from fills at held lengths."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.identify.volume_chapter import volume_chapter
from ...bench.identify.volume_fit import VolumeFit, fit_volume, volume_points
from ...bench.readers.reading_chapter import reading_chapters
from ...core.atomic_output import atomic_folder, check_writable
from ...core.declaration import parameters
from ...core.errors import ParameterError, PhysicsError
from ...core.units import quantity
from ...files.library.entry import Entry
from ...files.library.entry_file import load_law
from ...files.library.fitted_entry import list_files
from ...files.library.initial_law import resting_lengths
from ...files.library.write import part_toml, save
from ...physics.muscle.characteristic import ValidityRange
from ...physics.muscle.characteristic.energy_defect import EnergyDefect, maxwell_defect
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...recording import Recording
from ...report.chapter import Chapter
from ...report.write import write_into
from .bench_files import Files, read_recordings
from .fit_geometry import check_one_length
from .options import Folder, Json
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, percent, print_json, print_table


@with_reading_options
def fit_volume_command(
    files: Files,
    muscle: Annotated[
        str | None, typer.Option(metavar="NAME", help="Muscle whose geometry is replaced, for the Maxwell defect.")
    ] = None,
    temperature: Annotated[
        str, typer.Option(metavar="QUANTITY", help="Temperature of the air at both ends of a fill.")
    ] = "293.15 K",
    reading: ReadingOptions = NO_OPTIONS,
    out: Folder = Path("volume"),
    json: Json = False,
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
    entry = None if muscle is None else load_law(muscle)
    check_writable(out)
    recordings = read_recordings(files, reading)
    fit = fit_volume(volume_points(recordings, quantity(temperature, "K", where="--temperature")),
                     _length(recordings, entry))  # fmt: skip
    limits = None if entry is None else _limits(entry, fit)
    defect = None if entry is None or limits is None else _defect(entry, fit, limits)
    fitted = _entry(entry, fit, files) if entry is not None else None
    _write(fit, entry, fitted, limits, defect, files, out, reading_chapters(recordings))
    if json:
        print_json(_to_dict(fit, defect))
        return
    _print(fit, defect)
    echo(f"{'muscle' if fitted else 'geometry'}: {out / ('muscle.toml' if fitted else 'geometry.toml')}")
    echo(f"report: {out / 'report.html'}")


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
    note = f"Volume fitted to {list_files([f.name for f in files])}: {_summary(fit)}."
    return dataclasses.replace(entry, name="muscle", geometry=fit.geometry, provenance="fitted",
                               note=" ".join(filter(None, (entry.note, note))), checks=())  # fmt: skip


def _summary(fit: VolumeFit) -> str:
    deviation = float(fit.standard_deviation(fit.points.contraction).max())
    return (
        f"{type(fit.geometry).__name__}, rms residual {1e6 * fit.rmse:.4g} cm3, standard deviation of the volume at "
        f"most {1e6 * deviation:.4g} cm3"
    )


def _write(
    fit: VolumeFit, entry: Entry | None, fitted: Entry | None, limits: ValidityRange | None,
    defect: EnergyDefect | None, files: list[Path], out: Path, more: Sequence[Chapter],
) -> None:  # fmt: skip
    title = fitted.title if fitted else f"Volume fitted to {list_files([f.stem for f in files])}"
    law = entry.characteristic if entry is not None and limits is not None else None
    chapter = volume_chapter(fit, title, f"{_summary(fit)}.", law, limits, defect)
    with atomic_folder(out) as folder:
        if fitted is not None:
            save(fitted, folder / "muscle.toml")
        else:
            (folder / "geometry.toml").write_text(part_toml("geometry", fit.geometry), encoding="utf-8")
        write_into(folder, [chapter, *more], title="Volume")


def _print(fit: VolumeFit, defect: EnergyDefect | None) -> None:
    echo(_summary(fit))
    low, high = float(fit.points.contraction.min()), float(fit.points.contraction.max())
    rows = []
    for contraction in (low, (low + high) / 2, high):
        volume, error = float(fit.geometry.volume(contraction)), float(fit.standard_deviation([contraction])[0])  # type: ignore[arg-type]
        rows.append((percent(contraction), f"{1e6 * volume:.4g} cm3", f"{2e6 * error:.2g} cm3"))
    print_table(("contraction", "volume", "2 standard deviations"), rows, right=("volume",))
    if defect is not None:
        echo(f"Maxwell defect |dF/dp + dV/dL|: {defect}")


def _to_dict(fit: VolumeFit, defect: EnergyDefect | None) -> dict[str, Any]:
    """A volume fit as plain data, all numbers SI."""
    contraction = fit.points.contraction
    return {
        "model": type(fit.geometry).__name__,
        "parameters": {p.name: getattr(fit.geometry, p.name) for p in parameters(fit.geometry)},
        "points": len(contraction),
        "fills": fit.points.fills,
        "rmse": fit.rmse,
        "standard_deviation": float(fit.standard_deviation(contraction).max()),
        "aicc": fit.aicc,
        "maxwell_defect": None if defect is None else dataclasses.asdict(defect),
    }
