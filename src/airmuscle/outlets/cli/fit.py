"""`airmuscle fit`: a characteristic from measured points."""

from pathlib import Path

from ...bench import diagnosis
from ...core import check_writable
from ...files.library import to_toml
from ..requests import FitRequest, ReadingRequest, fit_requested
from ..requests.declaration import RequestError
from .delivery import Execution, deliver
from .measurements import Files, read_recordings
from .options import Folder, Json
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
    if (
        request.compare
        and (record := diagnosis.support_of(recordings).chapter_of_record()) is not None
    ):
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
