"""`airmuscle predict`: prediction of further records by an identified muscle or plant."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from ...bench import RecordPrediction, StartTime
from ...bench.prediction import prediction_chapters
from ...core import FileError, check_writable
from ...files.library import is_path, kind_of, list_plants, load_law, read_toml
from ...files.scenario.prediction import PlantModel, load_plant_model, predict_with_entry
from ...recording import Recording
from ..requests import ReadingRequest, RequestError, Where, many, optional, request
from .delivery import deliver
from .measurements import read_recordings, reading_chapters
from .options import Folder, Json, complete_model
from .parser import Argument
from .requested import with_requests

MODEL = (
    "A muscle file, a scenario of fit-dynamic or campaign, or a muscle, law or plant of the"
    " library."
)
Model = Annotated[str, Argument("MODEL", MODEL, complete_model)]
RECORDS = "Measurement files; for a scenario also a TOML file with [[record]], as of fit-dynamic."
Records = Annotated[list[Path], Argument("FILES", RECORDS)]


@request
class PredictRequest:
    """What the prediction of transient records is asked for."""

    start_time: float | None = optional(
        "Scenario: time of the record at which its input begins; default 0 s.", unit="s"
    )
    start_margin: float | None = optional(
        "Scenario: estimate the start time within this margin, '50 ms'.", unit="s"
    )
    own: tuple[str, ...] = many(
        "Scenario: parameter that is estimated from each record; repeatable.", metavar="PARAMETER"
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for a margin that is not positive."""
        if self.start_margin is not None and not self.start_margin > 0.0:
            raise RequestError(
                f"{where('start_margin')} is {self.start_margin:g} s; it must be greater than zero"
            )


def _predicted_by_plant(
    model: PlantModel,
    recordings: Sequence[Recording],
    tables: Sequence[Path],
    request: PredictRequest,
) -> list[RecordPrediction]:
    """The predictions of measured recordings, then of the records of files of records."""
    unknowns: list[Any] = list(request.own)
    if request.start_margin is not None:
        unknowns.append(StartTime(request.start_margin))
    start_time = request.start_time or 0.0
    predictions = [
        model.predict_recording(recording, start_time, unknowns) for recording in recordings
    ]
    for path in tables:
        predictions += model.predict_file(path)
    return predictions


@with_requests
def predict(
    model: Model,
    files: Records,
    request: PredictRequest,
    reading: ReadingRequest,
    out: Folder = Path("prediction"),
    json: Json = False,
) -> None:
    """Predict further records by an identified muscle or plant.

    \b
    A muscle predicts slow records from pressure and contraction, with its friction and creep along
    the motion. A scenario of fit-dynamic or campaign predicts transient records by simulation of
    its input. Prints rms error, maximum error and the share of rows within the stated 95 % band.
    Writes DIR/report.html with figures and data.

    \b
    Examples:
      airmuscle predict identified/muscle.toml later.csv --resting-length "300 mm"
      airmuscle predict dynamic/scenario.toml fill3.csv --start-time "0.2 s" --start-margin "50 ms"
      airmuscle predict dynamic/scenario.toml further-records.toml --out prediction
      airmuscle predict dmsp-20-300 bench.csv --json
    """
    check_writable(out)
    is_file = is_path(model) or Path(model).exists()
    tables = [path for path in files if path.suffix == ".toml"]
    measured = [path for path in files if path not in tables]
    thing: Any
    if kind_of(read_toml(Path(model))) == "plant" if is_file else model in list_plants():
        loaded = load_plant_model(model)
        recordings = read_recordings(measured, reading) if measured else []
        predictions = _predicted_by_plant(loaded, recordings, tables, request)
        thing = loaded.scenario.plant
    elif stated := [
        name for name in ("start_time", "start_margin", "own") if getattr(request, name)
    ]:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in stated)
        raise RequestError(f"{options} is for a scenario; MODEL is a muscle or a law")
    else:
        thing = load_law(model)
        if tables:
            raise FileError(
                f"{tables[0]}: a file of records is for a scenario; give measurement files for a"
                " muscle."
            )
        predictions = [
            predict_with_entry(thing, recording) for recording in read_recordings(files, reading)
        ]
    chapters = prediction_chapters(Path(model).name, thing, predictions)
    chapters += reading_chapters(prediction.recording for prediction in predictions)
    deliver("predict", chapters, json=json, out=out, title="Prediction")
