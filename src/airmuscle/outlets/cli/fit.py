"""`airmuscle fit`, `fit-volume` and `approximate`: a characteristic or volume law from measurements
or another law.
"""

import contextlib
import dataclasses
from pathlib import Path
from typing import Annotated, Any

from ...bench.diagnosis import support_of
from ...bench.statics import approximate as approximate_law
from ...bench.statics.approximation import GRID_POINTS, sample_on_grid
from ...bench.statics.volume_fit import fit_volume, volume_points
from ...core import ParameterError, PhysicsError, check_writable
from ...files.library import (
    find_initial_law,
    list_files,
    load_law,
    part_toml,
    resting_lengths,
    save,
    to_toml,
)
from ...physics.muscle.characteristic import ValidityRange, maxwell_defect, validity_range_of
from ..requests import FitRequest, ReadingRequest, check_one_length, fit_requested
from ..requests.declaration import RequestError, option, optional, request
from .delivery import Execution, deliver
from .measurements import Files, read_recordings, reading_chapters
from .options import Folder, Json, Name, complete_law
from .parser import Argument, CommandOption
from .printing import print_result
from .requested import with_requests
from .search_limit import SearchLimit
from .terminal import progress_bars


@with_requests
def fit(
    files: Files,
    request: FitRequest,
    reading: ReadingRequest,
    execution: Execution,
    limit: SearchLimit,
    out: Folder = Path("fit"),
    json: Json = False,
) -> None:
    """Fit a characteristic to measured points, or compare several.

    \b
    Writes DIR/muscle.toml, which every command accepts as NAME, and DIR/report.html with figures
    and data. FILES may also be data sets of the library (see airmuscle list). A misfit of the law
    is stated first; beyond ten times the scatter of the data DIR/muscle.toml needs --accept-misfit.
    A single isometric or isobaric record compares no laws: --compare then reports its threshold,
    slope, hysteresis and noise.

    \b
    Examples:
      airmuscle fit bench.csv --characteristic ContractileSurface --resting-length "300 mm" --out
          fit
      airmuscle fit bench.csv --characteristic ContractileSurface --braid "radius=10 mm, angle=24.4
          deg"
      airmuscle fit bench.csv --characteristic dmsp-20-300 --unit pressure=bar --fix wall_thickness
      airmuscle fit dmsp-20-300 --characteristic ContractileSurface --degree 4 --robust "10 N"
      airmuscle fit runs/*.csv --characteristic dmsp-20-300 --bootstrap 1000 --profile weak
      airmuscle fit bench.csv --characteristic ContractileSurface --shape --free-contraction "3
          bar=18 %"
      airmuscle fit runs/*.xlsx --mapping rig.toml --compare --leave-out run
      airmuscle fit muscles/*.csv --mapping rig.toml --compare --purpose both --length-error "20 cm"
      airmuscle fit muscles/*.csv --mapping rig.toml --compare --cluster cluster.toml
      airmuscle fit log_held*.csv --file-name "held{length [mm]}mm" --time uniform --resting-length
          "200 mm" --compare
      airmuscle evaluate fit/muscle.toml --pressure "3 bar" --force "100 N"
    """
    processes = (execution.workers, execution.cluster)
    if processes != (None, None) and not (request.compare or request.bootstrap):
        raise RequestError(
            "--workers and --cluster distribute the candidates of --compare and the refits of"
            " --bootstrap"
        )
    recordings = read_recordings(files, reading)
    check_writable(out)
    if request.compare and (record := support_of(recordings).chapter_of_record()) is not None:
        deliver("fit", [record], json=json, out=out, title="Single record")
        return
    progress = progress_bars("comparison" if request.compare else "fit")
    with (
        execution.executor(out) as executor,
        progress as show,
        limit.searches(out, lambda name, fraction: None),
    ):
        fitted = fit_requested(
            request, files, recordings, lambda _, fraction: show("", fraction), executor
        )
    muscle = {} if fitted.refusal else {"muscle.toml": to_toml(fitted.entry)}
    deliver("fit", fitted.chapters, json=json, out=out, title="Fitted muscle", files=muscle)


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


LIMIT = "Limit of the validity range; default: that of the muscle."
LIMITS = ("min_pressure", "max_pressure", "min_contraction", "max_contraction")
MODEL = "The other model: ContractileSurface, Sarosi2012, or a library entry of it."
Model = Annotated[str, Argument("MODEL", MODEL, complete_law)]
OUT = "Muscle file to write, with the other characteristic."
Out = Annotated[Path | None, CommandOption("--out", OUT, "FILE")]


@request
class ApproximateRequest:
    """Range and degree of an approximation."""

    min_pressure: float | None = optional(LIMIT, unit="Pa")
    max_pressure: float | None = optional(LIMIT, unit="Pa")
    min_contraction: float | None = optional(LIMIT, unit="1")
    max_contraction: float | None = optional(LIMIT, unit="1")
    degree: int = option("Total degree of a ContractileSurface.", default=5, bounds=(1, 9))


@with_requests
def approximate(
    name: Name, model: Model, request: ApproximateRequest, out: Out = None, json: Json = False
) -> None:
    """Approximate one characteristic by another.

    \b
    The error is the difference in force, where the original force is positive, over the validity
    range of the muscle or the range given by the options. With --out, FILE is the muscle with the
    other characteristic; its other parts are unchanged.

    \b
    Examples:
      airmuscle approximate dmsp-20-300 ContractileSurface --degree 5 --out surface.toml
      airmuscle approximate fit/muscle.toml Sarosi2012 --max-pressure "5 bar"
    """
    entry = load_law(name)
    stated: Any = {name: getattr(request, name) for name in LIMITS}
    default = validity_range_of(entry.characteristic, entry.validity_range)
    stated = {
        n: getattr(default, n, None) if value is None else value for n, value in stated.items()
    }
    if missing := [
        f"--{name.replace('_', '-')}" for name, value in stated.items() if value is None
    ]:
        raise ParameterError(
            f"{entry.name} has no validity range for the approximation; give {', '.join(missing)}."
        )
    limits = ValidityRange(**stated)
    grid = sample_on_grid(entry.characteristic, limits, GRID_POINTS)
    length = getattr(entry.geometry, "resting_length", None)
    data = grid if length is None else grid.with_constants(resting_length=length)
    initial, _ = find_initial_law(model, [data], request.degree, "MODEL")
    approximation = approximate_law(entry.characteristic, initial.characteristic, limits)
    chapter = approximation.chapter()
    original = type(entry.characteristic).__name__
    if out is not None:
        note = f"Approximated from {entry.name}: {approximation.summary}. {entry.note}".strip()
        approximated = dataclasses.replace(
            entry,
            name="muscle",
            title=f"{type(approximation.model).__name__} in place of {original}: {entry.title}",
            provenance="fitted",
            note=note,
            characteristic=approximation.model,
            validity_range=approximation.validity_range,
            checks=(),
        )
        save(approximated, out)
    title = f"{entry.name}, {original}, by {chapter.title}"
    print_result(
        [dataclasses.replace(chapter, title=title)], {} if out is None else {"muscle": out}, json
    )
