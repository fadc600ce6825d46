"""`airmuscle evaluate` and `airmuscle show`: a library entry at an operating point, and what it contains."""

from ...files.library import UNITS, load
from ...files.library import evaluate as evaluate_entry
from ...physics.muscle.isobar_plot import describe_point, isobar_table
from ...report.write import rendered_figure, save_table
from ..requests import EntryRequest, RequestError, Where, option, request
from .delivery import print_result, write_result
from .options import Json, Name, OptionalFolder, with_requests
from .terminal import echo


@request
class EvaluateRequest:
    """Two of pressure, contraction and force."""

    pressure: float | None = option(
        "Pressure with unit: '3 bar' (gauge), '400 kPa', '4 bara' (at 101.325 kPa ambient).", unit="Pa", default=None
    )
    contraction: float | None = option("Contraction: 0.12 or '12 %'.", unit="1", default=None)
    force: float | None = option("Tension with unit: '100 N', '0.1 kN'.", unit="N", default=None)

    def check(self, where: Where) -> None:
        """Raise RequestError unless two quantities are given."""
        if len(self.given) != 2:
            pressure, contraction, force = map(where, UNITS)
            raise RequestError(f"give two of {pressure}, {contraction} and {force}, not {len(self.given)}")

    @property
    def given(self) -> dict[str, float]:
        """The given quantities [SI]."""
        return {name: value for name in UNITS if (value := getattr(self, name)) is not None}


@with_requests
def evaluate(
    name: Name, point: EvaluateRequest, variant: EntryRequest, out: OptionalFolder = None, json: Json = False
) -> None:
    """Evaluate a law for two of pressure, contraction and force.

    \b
    If several solutions exist, the result is the one reached from the state of rest.
    A point that the maker does not permit is refused, or, where it was measured, reported with a warning.
    With --out, DIR/isobars.png and DIR/isobars.csv show force over contraction, with the operating point.

    \b
    Examples:
      airmuscle evaluate dmsp-20-300 --pressure "3 bar" --force "100 N"
      airmuscle evaluate dmsp-20-300 --contraction "12 %" --force "100 N" --out chart
      airmuscle evaluate tondu-lopez --diameter "30 mm" --resting-length "200 mm" --pressure "3 bar" --force "100 N"
      airmuscle evaluate saga2007 --set characteristic.slope_factor=2 --pressure "1 bar" --contraction "5 %"
      airmuscle evaluate my/muscle.toml --pressure "400 kPa" --contraction 0.1 --json
    """
    found = evaluate_entry(variant.load(name), point.given)
    chapter = found.chapter()
    print_result([chapter], {}, json)
    if out is not None:
        files = {
            "isobars.csv": lambda path: save_table(isobar_table(found.isobars()), path),
            "isobars.png": lambda path: path.write_bytes(rendered_figure(chapter.plots[0])["png"]),
        }
        write_result(out, [], "", files)
        echo(f"chart: {out / 'isobars.png'}, data: {out / 'isobars.csv'} ({describe_point(found.point)})", err=json)


@with_requests
def show(name: Name, variant: EntryRequest, json: Json = False) -> None:
    """Show parameters, sources and checks of a library entry.

    The table of parameters contains symbol, value, unit, meaning and bounds.

    \b
    Examples:
      airmuscle show dmsp-20-300
      airmuscle show matrix-821
      airmuscle show festo-dmsp-20
      airmuscle show my/muscle.toml --json
    """
    chapter = variant.load(name, load).chapter()
    print_result([chapter], {}, json)
    for reference in () if json else chapter.references:
        echo(f"- {reference}")
