"""`airmuscle fit-joint`: a joint or an arm from episodes of its pressures and angles."""

from pathlib import Path
from typing import Annotated

from ...core import check_writable
from ..requests.joint import JointFitRequest, fit_requested_arm, inspect_requested
from .delivery import Execution, deliver
from .options import Folder, Json
from .parser import Argument
from .requested import with_requests
from .search_limit import SearchLimit
from .terminal import echo

Episodes = Annotated[
    Path, Argument("EPISODES", "A folder of episodes or bags, or one file with all.")
]


@with_requests
def fit_joint_command(
    source: Episodes,
    request: JointFitRequest,
    execution: Execution,
    limit: SearchLimit,
    out: Folder = Path("joint"),
    json: Json = False,
) -> None:
    """Identify a joint or an arm from its episodes.

    \b
    Episodes are short records with angles of the joints and pressures of their muscles: CSV, NPZ,
    JSON, HDF5, Parquet, ROS bags or RLDS-like steps, one file each or one for all. The mapping file
    says which column is what, in which unit, and may state the muscles of each joint and the axes
    of the joints; without one it is proposed. The free run is judged on the last episodes, beside
    persistence and a linear ARX model. Writes DIR/report.html, DIR/scenario.toml, the arm with a
    pressure regulator for each muscle and the covariance of its parameters, and
    DIR/controlled.toml, the same with a controller of each angle to be tuned.

    \b
    Examples:
      airmuscle fit-joint episodes/ --mapping arm.toml --inspect
      airmuscle fit-joint episodes.npz --mapping arm.toml --out arm
      airmuscle fit-joint episodes --mapping arm.toml --known joint.toml --free mechanism.inertia
          --free zeros
    """
    if request.inspect:
        echo(str(inspect_requested(source, request)))
        return
    check_writable(out)
    with execution.executor(out, alone=True) as workers, limit.searches(out):
        chapter, files = fit_requested_arm(
            source, request, lambda text: None if json else echo(text), workers
        )
    deliver("fit-joint", [chapter], json=json, out=out, title="Identified arm", files=files)
