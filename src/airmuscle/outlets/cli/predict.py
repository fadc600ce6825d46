"""`airmuscle predict`: prediction of further records by an identified muscle or plant."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.identify.dynamic import StartTime
from ...bench.identify.prediction import RecordPrediction
from ...bench.identify.prediction.prediction_chapter import band_sources, describe_band, prediction_chapters, with_unit
from ...bench.readers.reading_chapter import reading_chapters
from ...core.atomic_output import atomic_folder, check_writable
from ...core.errors import FileError
from ...core.units import quantity
from ...files.library.entry import PlantEntry
from ...files.library.entry_file import kind_of, load_law
from ...files.library.entry_prediction import predict_with_entry
from ...files.library.files import is_path, list_plants, read_toml
from ...files.scenario.prediction import load_plant_model
from ...report.write import write_into
from .bench_files import read_recordings
from .completion import complete_model
from .options import Folder, Json
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, print_json, print_table

Model = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="A muscle file, a scenario of fit-dynamic or campaign, or a muscle, law or plant of the library.",
        autocompletion=complete_model,
    ),
]
Records = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILES",
        help="Measurement files; for a scenario also a TOML file with [[record]], as of fit-dynamic.",
    ),
]
Start = Annotated[
    str | None,
    typer.Option(
        "--start-time", metavar="QUANTITY", help="Scenario: time of the record at which its input begins; default 0 s."
    ),
]
Margin = Annotated[
    str | None,
    typer.Option(
        "--start-margin", metavar="QUANTITY", help="Scenario: estimate the start time within this margin, '50 ms'."
    ),
]
Own = Annotated[
    list[str] | None,
    typer.Option(
        "--own", metavar="PARAMETER", help="Scenario: parameter that is estimated from each record; repeatable."
    ),
]


@with_reading_options
def predict(
    model: Model,
    files: Records,
    start_time: Start = None,
    start_margin: Margin = None,
    own: Own = None,
    out: Folder = Path("prediction"),
    reading: ReadingOptions = NO_OPTIONS,
    json: Json = False,
) -> None:
    """Predict further records by an identified muscle or plant.

    \b
    A muscle predicts slow records from pressure and contraction, with its friction and creep along the motion. A
    scenario of fit-dynamic or campaign predicts transient records by simulation of its input.
    Prints rms error, maximum error and the share of rows within the stated 95 % band. Writes DIR/report.html with
    figures and data.

    \b
    Examples:
      airmuscle predict identified/muscle.toml later.csv --resting-length "300 mm"
      airmuscle predict dynamic/scenario.toml fill3.csv --start-time "0.2 s" --start-margin "50 ms"
      airmuscle predict dynamic/scenario.toml further-records.toml --out prediction
      airmuscle predict dmsp-20-300 bench.csv --json
    """
    check_writable(out)
    options = {"--start-time": start_time, "--start-margin": start_margin, "--own": own}
    if _is_plant(model):
        thing, predictions = _transient(model, files, reading, start_time, start_margin, own or ())
    else:
        unused = [name for name, value in options.items() if value]
        if unused:
            raise typer.BadParameter(f"{', '.join(unused)} is for a scenario; MODEL is a muscle or a law")
        thing, predictions = _static(model, files, reading)
    with atomic_folder(out) as folder:
        chapters = prediction_chapters(Path(model).name, thing, predictions)
        chapters += reading_chapters(each.recording for each in predictions)
        write_into(folder, chapters, title="Prediction")
    if json:
        print_json(
            {
                "model": model,
                "band": "; ".join(band_sources(predictions)),
                "records": [_to_dict(each) for each in predictions],
            }
        )
        return
    _print(predictions)
    echo(f"report: {out / 'report.html'}")


def _is_plant(model: str) -> bool:
    """Whether the model is a plant: a scenario file, or a plant of the library."""
    if is_path(model) or Path(model).exists():
        return kind_of(read_toml(Path(model))) is PlantEntry
    return model in list_plants()


def _static(model: str, files: list[Path], reading: ReadingOptions) -> tuple[Any, list[RecordPrediction]]:
    entry = load_law(model)
    tables = [path for path in files if path.suffix == ".toml"]
    if tables:
        raise FileError(f"{tables[0]}: a file of records is for a scenario; give measurement files for a muscle.")
    recordings = read_recordings(files, reading)
    return entry, [predict_with_entry(entry, recording) for recording in recordings]


def _transient(
    model: str, files: list[Path], reading: ReadingOptions, start: str | None, margin: str | None, own: Sequence[str]
) -> tuple[Any, list[RecordPrediction]]:
    loaded = load_plant_model(model)
    begun = 0.0 if start is None else quantity(start, "s", where="--start-time")
    unknowns: list[Any] = list(own)
    if margin is not None:
        within = quantity(margin, "s", where="--start-margin")
        if not within > 0.0:
            raise typer.BadParameter(f"--start-margin is '{margin}'; it must be greater than zero")
        unknowns.append(StartTime(within))
    measured = [path for path in files if path.suffix != ".toml"]
    recordings = read_recordings(measured, reading) if measured else []
    predictions = [loaded.predict_recording(recording, begun, unknowns) for recording in recordings]
    for path in files:
        if path not in measured:
            predictions += loaded.predict_file(path)
    return loaded.scenario.plant, predictions


def _print(predictions: Sequence[RecordPrediction]) -> None:
    rows = []
    for each in predictions:
        for item in each.quantities:
            share = "–" if item.share is None else f"{100.0 * item.share:.3g} %"
            greatest = f"{with_unit(item.max_error, item.name)} (row {item.worst_row + 1})"
            compared = str(int(item.compared.sum()))
            rms, half = with_unit(item.rms, item.name), describe_band(item)
            rows.append((each.origin, item.name, compared, rms, greatest, half, share))
    headers = ("record", "quantity", "rows", "rms error", "maximum error", "95 % band", "within")
    print_table(headers, rows, right=("rows", "rms error", "maximum error", "95 % band", "within"))
    for source in band_sources(predictions):
        echo(f"band: {source}")
    for each in predictions:
        for note in each.notes:
            echo(f"note: {each.origin}: {note}")


def _to_dict(prediction: RecordPrediction) -> dict[str, Any]:
    """A prediction as plain data, all numbers SI, rows counted from 1."""
    return {
        "record": prediction.origin,
        "quantities": {
            each.name: {
                "rows": int(each.compared.sum()),
                "rms": each.rms,
                "max_error": each.max_error,
                "max_error_row": each.worst_row + 1,
                "band": each.band,
                "half_width": None if each.half_width is None else each.half_width.tolist(),
                "share": each.share,
            }
            for each in prediction.quantities
        },
        "notes": list(prediction.notes),
    }
