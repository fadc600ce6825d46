"""`airmuscle audit`: a law, an orifice or constants of others, for what physics forbids."""

from pathlib import Path
from typing import Annotated

from ...core import check_writable
from ...design.audit import (
    AuditedLaw,
    AuditResult,
    EnclosedVolume,
    FunctionProcess,
    audit_constants,
    audit_law,
    audit_orifice,
    law_of_entry,
    law_of_points,
)
from ...design.audit.constants import is_list_of_constants
from ...files.library import load_law
from ..requests.declaration import RequestError, Where, option, optional, request
from .delivery import deliver
from .options import Json, OptionalFolder
from .parser import Argument
from .requested import with_requests

Target = Annotated[
    str,
    Argument(
        "TARGET",
        "A function module:name, a library entry, a muscle file, or a CSV file of points or of"
        " constants.",
    ),
]
KINDS = ("law", "orifice")


@request
class AuditRequest:
    """What a function is, and its range."""

    kind: str = option(
        f"What a function is: {', '.join(KINDS)}.", choices=KINDS, default="law", metavar="KIND"
    )
    pressure: float = option("Greatest gauge pressure of the law.", unit="Pa", default="6 bar")
    contraction: float = option("Greatest contraction of the law.", unit="1", default="25 %")
    volume: str | None = optional(
        "Function module:name of the enclosed volume [m3] of a contraction and 0, for the energy.",
        metavar="MODULE:NAME",
    )
    resting_length: float | None = optional(
        "Resting length of the muscle, for the energy.", unit="m"
    )

    def check(self, where: Where) -> None:
        """Raise RequestError for half of what the energy needs."""
        if (self.volume is None) != (self.resting_length is None):
            raise RequestError(
                f"{where('volume')} and {where('resting_length')} belong together; give both"
            )

    def audit(self, target: str) -> AuditResult:
        """The audit of a target. Raises FileError, UnknownNameError and FunctionError."""
        if ":" in target and not Path(target).exists():
            return self._audit_of_function(target)
        path = Path(target)
        if path.suffix.lower() in (".csv", ".txt", ".tsv"):
            return (
                audit_constants(path)
                if is_list_of_constants(path)
                else audit_law(law_of_points(path))
            )
        return self._audit_of_entry(target)

    def _audit_of_function(self, name: str) -> AuditResult:
        function = FunctionProcess(name)
        if self.kind == "orifice":
            return audit_orifice(name, function, lambda: function.evaluations)
        enclosed: EnclosedVolume | None = None
        if self.volume is not None and self.resting_length is not None:
            volume = FunctionProcess(self.volume)
            enclosed = EnclosedVolume(lambda at: volume(at, 0.0), self.resting_length)
        law = AuditedLaw(name, function, (0.0, self.pressure), (0.0, self.contraction), enclosed)
        return audit_law(law)

    def _audit_of_entry(self, name: str) -> AuditResult:
        return audit_law(law_of_entry(load_law(name)))


@with_requests
def audit(
    target: Target, request: AuditRequest, out: OptionalFolder = None, json: Json = False
) -> None:
    """Examine a muscle law, an orifice or constants of others.

    \b
    Looks for what physics forbids and for what goes wrong in practice: a force that explodes beyond
    the range, pushes, jumps, or grows with contraction; bar for Pa, per cent for a ratio, absolute
    for gauge; a cycle that gives energy; an orifice that does not choke; constants that differ from
    print or that no muscle has. Each finding has the calls that show it. A function runs in a
    process of its own, and needs --allow-code. Exit code 1 where something is found.

    \b
    Examples:
      airmuscle audit dmsp-20-300
      airmuscle audit mymodel:force --pressure "6 bar" --contraction "25 %" --allow-code
      airmuscle audit mymodel:flow --kind orifice --allow-code
      airmuscle audit constants.csv --out audit
    """
    if out is not None:
        check_writable(out)
    result = request.audit(target)
    deliver("audit", [result.chapter()], json=json, out=out, title="Audit")
    if result.findings:
        raise SystemExit(1)
