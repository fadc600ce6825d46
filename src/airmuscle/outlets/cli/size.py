"""`airmuscle size`: muscles of the catalogue for a lift, a joint or a gripper."""

import functools
from collections.abc import Callable
from pathlib import Path

from ...core import check_writable, plotting
from ...design.sizing import sheet_page, sizing_scenario, sizing_sheet
from ..requests.size import SizeRequest
from .delivery import Execution, deliver
from .options import Json, OptionalFolder
from .requested import with_requests
from .terminal import progress_bars

SCENARIO_FILE = "scenario.toml"


@with_requests
def size(
    request: SizeRequest, execution: Execution, out: OptionalFolder = None, json: Json = False
) -> None:
    """Size muscles of the catalogue for a lift, a joint or a gripper.

    \b
    For each muscle whose law and permitted values are known: the shortest length that reaches both
    ends of the motion within ratings, validity range and supply, alone and in parallel, with
    pressures, reserve and air of a cycle. With --out, DIR/report.html shows the force-contraction
    chart and all choices, DIR/sheet.pdf and sheet.html are the best choice on one page of A4, and
    DIR/scenario.toml is it for `airmuscle simulate`, with valves for the cycle time.

    \b
    Examples:
      airmuscle size --load "20 kg" --stroke "40 mm" --supply "6 bar" --max-length "400 mm" --out
          lift
      airmuscle size --load "100 N" --stiffness "2 N/mm" --stroke "40 mm" --supply "6 bar" --sort
          length
      airmuscle size --torque "5 N m" --angle "60 deg" --inertia "0.05 kg m^2" --supply "6 bar"
          --max-count 1
      airmuscle size --grip "50 N" --opening "20 mm" --lever 2 --supply "6 bar" --out gripper
    """
    if out is not None:
        check_writable(out)
    with execution.executor(out, alone=True) as workers, progress_bars("sizing") as show:
        result = request.evaluate(lambda fraction: show("", fraction), workers)
    scenario = sizing_scenario(
        result.best, SCENARIO_FILE if out is not None else "scenario.toml of --out"
    )
    files: dict[str, str | Callable[[Path], object]] = {}
    if out is not None:
        figure = sizing_sheet(result)
        files["sheet.html"] = sheet_page(figure, f"Sizing: {result.best.size}")
        files["sheet.pdf"] = functools.partial(plotting.save, figure)
    if scenario.text:
        files[SCENARIO_FILE] = scenario.text
    deliver("size", [result.chapter(scenario)], json=json, out=out, title="Sizing", files=files)
