"""`airmuscle compare`: the controllers of scenarios on one plant and its truths."""

from pathlib import Path
from typing import Annotated, Any

from ...core import SimulationError, check_writable
from ...design.control_comparison import compare_scenarios, read_seeds
from ..requests.declaration import Where, check_rules, many, option, optional, request
from .delivery import Execution, deliver
from .options import Folder, Json
from .parser import Argument
from .requested import with_requests
from .terminal import counted_progress

SCENARIOS = "Scenario files with [input.controller], two or more; of one alone its robustness."
ScenarioFiles = Annotated[list[Path], Argument("SCENARIO.toml", SCENARIOS)]
DEFAULT_SEEDS = "1-8"


@request
class CompareRequest:
    """What a comparison of controllers is asked for."""

    rig: Path | None = optional(
        "Scenario whose plant, initial state, duration and other inputs hold for all. Default: all"
        " scenarios have the same.",
        metavar="SCENARIO.toml",
    )
    spread: tuple[str, ...] = many(
        "Range of a parameter of the truths: 'mechanism.mass=20 %', 'mechanism.mass=4 kg:7 kg', or"
        " '*.conductance=30 %' for all alike. Repeatable.",
        metavar="PATH=RANGE",
    )
    delay: int = option(
        "Greatest dead time of the measurements that nobody knows, in samples; drawn for each"
        " truth.",
        default=0,
        bounds=(0, 100),
    )
    truth_seeds: Any = optional(
        f"Seeds of the truths, such as 101-108 or 1,2,5; '' for none. Default: {DEFAULT_SEEDS}"
        " with a spread or a delay, otherwise none.",
        metavar="SEEDS",
        read=read_seeds,
        empty=True,
    )
    begin: float = option(
        "Time from the start from which on errors are judged.", unit="s", default="0 s"
    )

    def check(self, where: Where) -> None:
        """Refuse a spread without truths."""
        check_rules(
            {
                f"{where('spread')} and {where('delay')} need {where('truth_seeds')}, for each of"
                " which a truth is drawn; give 1-8, or omit them.": (
                    bool(self.spread or self.delay) and self.truth_seeds == ()
                )
            }
        )

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds of the truths."""
        if self.truth_seeds is not None:
            return tuple(self.truth_seeds)
        return read_seeds(DEFAULT_SEEDS) if self.spread or self.delay else ()


@with_requests
def compare(
    scenarios: ScenarioFiles,
    request: CompareRequest,
    execution: Execution,
    out: Folder = Path("comparison"),
    json: Json = False,
) -> None:
    """Compare the controllers of scenarios on one plant.

    \b
    All controllers run on the plant of the scenarios and on truths, which are drawn from the stated
    spreads and from the uncertainty that muscle or scenario files state; a controller knows the
    nominal plant alone. Errors, effort, strokes, air and margins are in DIR/report.html,
    DIR/figures/ and DIR/data/. An interrupted comparison resumes with the same command.

    \b
    Examples:
      airmuscle compare examples/pressure_loop.toml loop-tuned.toml --out comparison
      airmuscle compare pid.toml cascade.toml --spread "mechanism.mass=20 %"
          --spread "*.conductance=30 %" --delay 1 --truth-seeds 101-108
      airmuscle compare pid.toml cascade.toml --rig bench.toml --begin "0.5 s" --json
      airmuscle compare pid.toml cascade.toml --truth-seeds 1-200 --cluster tcp://head-node:8786
    """
    check_writable(out)
    with execution.executor(out) as workers, counted_progress("runs") as show:
        result = compare_scenarios(
            scenarios,
            rig=request.rig,
            spreads=request.spread,
            truth_seeds=request.seeds,
            delay=request.delay,
            begin=request.begin,
            workers=workers,
            progress=lambda done, total: show("runs", done, total),
        )
    deliver(
        "compare",
        [result.chapter()],
        json=json,
        out=out,
        title="Comparison of controllers",
    )
    runs = list(result.runs.values())
    if not any(run.metrics for run in runs):
        raise SimulationError(f"all runs failed; reason of the first: {runs[0].reason}")
