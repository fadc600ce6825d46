"""`airmuscle diff`: what differs between two muscles or laws."""

from typing import Annotated

from ...core import check_writable
from ...files.library import compare_entries, load_law
from .delivery import deliver
from .options import Json, OptionalFolder
from .parser import Argument
from .requested import with_requests

First = Annotated[str, Argument("FIRST", "A library entry or a muscle file.")]
Second = Annotated[str, Argument("SECOND", "The entry or file that is compared with it.")]


@with_requests
def diff(first: First, second: Second, out: OptionalFolder = None, json: Json = False) -> None:
    """Compare two muscles or laws: parameters and forces.

    \b
    The parameters that differ, by their path in the file, and the difference of the forces along
    isobars in the range in which both are valid, with the point at which it is greatest.

    \b
    Examples:
      airmuscle diff dmsp-20-300 festo-tool-dmsp-20
      airmuscle diff dmsp-20-300 my/muscle.toml --out difference
    """
    if out is not None:
        check_writable(out)
    result = compare_entries(load_law(first), load_law(second))
    deliver("diff", [result.chapter()], json=json, out=out, title="Difference")
