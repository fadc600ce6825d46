"""`airmuscle evaluate`: a law at an operating point."""

import contextlib

from ... import report
from ...core import STANDARD_GRAVITY, UnitError, quantity
from ...files.library import UNITS
from ...files.library import evaluate as evaluate_entry
from ...physics.muscle.working_point import describe_point
from ..requests import RequestError, Where, optional, request
from .entry_request import EntryRequest
from .options import Json, Name, OptionalFolder
from .printing import print_result, write_result
from .requested import with_requests
from .terminal import echo


def read_tension(text: str, where: str) -> float:
    """A force [N], also of a load in g or kg by standard gravity. Raises UnitError."""
    try:
        return float(quantity(text, "N", where=where))
    except UnitError:
        with contextlib.suppress(UnitError):
            return float(quantity(text, "kg", where=where)) * STANDARD_GRAVITY
        raise


@request
class EvaluateRequest:
    """Two of pressure, contraction and force."""

    pressure: float | None = optional(
        "Pressure with unit: '3 bar' (gauge), '400 kPa', '4 bara' (at 101.325 kPa ambient).",
        unit="Pa",
    )
    contraction: float | None = optional("Contraction: 0.12 or '12 %'.", unit="1")
    force: float | None = optional(
        "Tension with unit: '100 N', '0.1 kN'; a load in kg is its weight.",
        metavar="QUANTITY",
        read=read_tension,
    )

    def check(self, where: Where) -> None:
        """Raise RequestError unless two quantities are given."""
        if len(self.given) != 2:
            pressure, contraction, force = map(where, UNITS)
            raise RequestError(
                f"give two of {pressure}, {contraction} and {force}, not {len(self.given)}"
            )

    @property
    def given(self) -> dict[str, float]:
        """The given quantities [SI]."""
        return {name: value for name in UNITS if (value := getattr(self, name)) is not None}


@with_requests
def evaluate(
    name: Name,
    point: EvaluateRequest,
    variant: EntryRequest,
    out: OptionalFolder = None,
    json: Json = False,
) -> None:
    """Evaluate a law for two of pressure, contraction and force.

    \b
    If several solutions exist, the result is the one reached from the state of rest.
    A point that the maker does not permit is refused, or, where it was measured, reported with a
    warning. With --out, DIR/isobars.png and DIR/isobars.csv show force over contraction, with the
    operating point.

    \b
    Examples:
      airmuscle evaluate dmsp-20-300 --pressure "3 bar" --force "100 N"
      airmuscle evaluate dmsp-20-300 --contraction "12 %" --force "100 N" --out chart
      airmuscle evaluate tondu-lopez --diameter "30 mm" --resting-length "200 mm" --pressure "3 bar"
          --force "100 N"
      airmuscle evaluate saga2007 --set characteristic.slope_factor=2 --pressure "1 bar"
          --contraction "5 %"
      airmuscle evaluate my/muscle.toml --pressure "400 kPa" --contraction 0.1 --json
    """
    evaluation = evaluate_entry(variant.load(name), point.given)
    chapter = evaluation.chapter()
    print_result([chapter], {}, json)
    if out is not None:
        write_result(
            out,
            [],
            "",
            {
                "isobars.csv": lambda path: report.save_table(evaluation.isobar_table(), path),
                "isobars.png": lambda path: path.write_bytes(
                    report.rendered_figure(chapter.plots[0])["png"]
                ),
            },
        )
        echo(
            f"chart: {out / 'isobars.png'}, data: {out / 'isobars.csv'}"
            f" ({describe_point(evaluation.point)})",
            err=json,
        )
