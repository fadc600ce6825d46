"""`airmuscle recipe`: law and spread of a muscle before it is made."""

from collections.abc import Callable
from pathlib import Path

from ...core import check_writable
from ...files.library import to_toml
from ..requests.recipe import RecipeRequest
from .delivery import deliver
from .options import Json, OptionalFolder
from .requested import with_requests

MUSCLE_FILE = "muscle.toml"
POINTS_FILE = "points.csv"


@with_requests
def recipe(request: RecipeRequest, out: OptionalFolder = None, json: Json = False) -> None:
    """Predict a muscle made by hand from tube, braid and length.

    \b
    Free contraction, force and dead zone with the spread that the tolerances of a caliper and of
    the hardness give, before a muscle is made. With --out, DIR/muscle.toml is the muscle for every
    command, and DIR/points.csv has the twelve points to measure, whose forces you fill in.

    \b
    Examples:
      airmuscle recipe --bore "7 mm" --wall "1 mm" --length "200 mm" --shore 50 --angle "25 deg"
          --pressure "5 bar" --out nine
      airmuscle recipe --bore "3 mm" --wall "1 mm" --length "150 mm" --modulus "2 MPa" --turn "20
          mm" --thread "0.2 mm" --threads 48 --pressure "5 bar"
    """
    if out is not None:
        check_writable(out)
    prediction = request.predict()
    files: dict[str, str | Callable[[Path], object]] = {}
    if out is not None:
        files[MUSCLE_FILE] = to_toml(prediction.entry(out.name))
        files[POINTS_FILE] = prediction.points_csv()
    deliver("recipe", [prediction.chapter()], json=json, out=out, title="Recipe", files=files)
