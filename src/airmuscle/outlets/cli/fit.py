"""`airmuscle fit`: identification of a characteristic from measurement files."""

from pathlib import Path

from ...core import check_writable
from ...files.library.write import to_toml
from ..requests import FitRequest, ReadingRequest, RequestError, fit_requested
from .bench_files import Files, read_recordings
from .delivery import deliver
from .execution import Execution
from .options import Folder, Json
from .request_options import with_requests
from .terminal import computation_progress


@with_requests
def fit(
    files: Files,
    request: FitRequest,
    reading: ReadingRequest,
    execution: Execution,
    out: Folder = Path("fit"),
    json: Json = False,
) -> None:
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
    if writes:
        check_writable(out)
    progress = computation_progress("comparison" if request.compare else "fit")
    with execution.executor() as executor, progress as show:
        found = fit_requested(request, files, recordings, lambda _, fraction: show(fraction), executor)
    muscle = {"muscle.toml": to_toml(found.entry)}
    writes = writes or execution.takes_over(out)
    deliver("fit", found.chapters, json=json, out=out, title="Fit", files=muscle, writes=writes)
