"""`airmuscle predict`: prediction of further records by an identified muscle or plant."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from ...bench import RecordPrediction, StartTime
from ...bench.prediction import prediction_chapters
from ...core import FileError, check_writable
from ...files.library import is_path, kind_of, list_plants, load_law, read_toml
from ...files.scenario import arm_file, is_identified_arm
from ...files.scenario.prediction import PlantModel, load_plant_model, predict_with_entry
from ...recording import Recording
from ...report.chapter import Chapter
from ..requests import ReadingRequest, RequestError, Where, many, optional, request
from ..requests.joint import predict_later
from .delivery import deliver
from .measurements import read_recordings, reading_chapters
from .options import Folder, Json, complete_model
from .parser import Argument
from .requested import with_requests

MODEL = (
    "A muscle file, a scenario of fit-dynamic or campaign, an arm of fit-joint (its folder or"
    " scenario), or a muscle, law or plant of the library."
)
Model = Annotated[str, Argument("MODEL", MODEL, complete_model)]
RECORDS = (
    "Measurement files; for a scenario also a TOML file with [[record]], as of fit-dynamic; for an"
    " arm its later episodes, files, bags or folders."
)
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

    horizon: int | None = optional(
        "Arm: rows of the free run; default: those of its fit.",
        bounds=(5, 1000),
        metavar="ROWS",
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
    """Predict further records by an identified muscle, plant or arm.

    \b
    A muscle predicts slow records from pressure and contraction, with its friction and creep along
    the motion. A scenario of fit-dynamic or campaign predicts transient records by simulation of
    its input. An arm of fit-joint predicts later episodes in free run from pressures: their columns
    are those of its record, or of the mapping file that --mapping names. Prints rms error, maximum
    error or skill, and the share of rows within the stated 95 % band. Writes DIR/report.html with
    figures and data; of an arm DIR/data/angles.csv has measured and predicted angles.

    \b
    Examples:
      airmuscle predict identified/muscle.toml later.csv --resting-length "300 mm"
      airmuscle predict dynamic/scenario.toml fill3.csv --start-time "0.2 s" --start-margin "50 ms"
      airmuscle predict dynamic/scenario.toml further-records.toml --out prediction
      airmuscle predict joint/scenario.toml later-episodes/ --out prediction
      airmuscle predict dmsp-20-300 bench.csv --json
    """
    check_writable(out)
    if _is_arm(model):
        chapters = _predicted_by_arm(model, files, request, reading)
    else:
        chapters = _predicted_records(model, files, request, reading)
    deliver("predict", chapters, json=json, out=out, title="Prediction")


def _is_arm(model: str) -> bool:
    """Whether the model is an arm that fit-joint has written."""
    path = arm_file(model)
    return path.is_file() and is_identified_arm(read_toml(path))


def _predicted_by_arm(
    model: str, sources: Sequence[Path], request: PredictRequest, reading: ReadingRequest
) -> list[Chapter]:
    """The prediction of later episodes by an arm."""
    _refuse("is not for an arm, which takes --mapping and --horizon", request, ("horizon",))
    _refuse("is not for an arm, which takes --mapping and --horizon", reading, ("mapping",))
    prediction = predict_later(arm_file(model), sources, reading.mapping, request.horizon)
    return [prediction.chapter()]


def _refuse(reason: str, stated: PredictRequest | ReadingRequest, allowed: Sequence[str]) -> None:
    """Raise RequestError for options that are stated and not allowed."""
    default = type(stated)()
    names = [
        name
        for name, value in vars(stated).items()
        if name not in allowed and value != getattr(default, name)
    ]
    if names:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in names)
        raise RequestError(f"{options} {reason}")


def _predicted_records(
    model: str, files: Sequence[Path], request: PredictRequest, reading: ReadingRequest
) -> list[Chapter]:
    """The predictions of records by a muscle, a law or a plant."""
    if request.horizon is not None:
        raise RequestError("--horizon is for an arm of fit-joint; MODEL is none")
    is_file = is_path(model) or Path(model).exists()
    tables = [path for path in files if path.suffix == ".toml"]
    measured = [path for path in files if path not in tables]
    thing: Any
    if kind_of(read_toml(Path(model))) == "plant" if is_file else model in list_plants():
        loaded = load_plant_model(model)
        recordings = read_recordings(measured, reading) if measured else []
        predictions = _predicted_by_plant(loaded, recordings, tables, request)
        thing = loaded.scenario.plant
    else:
        _refuse("is for a scenario; MODEL is a muscle or a law", request, ())
        thing = load_law(model)
        if tables:
            raise FileError(
                f"{tables[0]}: a file of records is for a scenario; give measurement files for a"
                " muscle."
            )
        predictions = [
            predict_with_entry(thing, recording)
            for recording in read_recordings(list(files), reading)
        ]
    chapters = prediction_chapters(Path(model).name, thing, predictions)
    return [*chapters, *reading_chapters(prediction.recording for prediction in predictions)]
