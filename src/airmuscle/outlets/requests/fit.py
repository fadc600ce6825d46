"""Request of a static fit: a law fitted to measured points, or the comparison of all laws, with what is asked of it."""

from collections.abc import Mapping
from typing import Any

from ...bench.identify import BlockSplit, GroupSplit, Huber, LeastSquares, LevelSplit, Loss, RunSplit, SpecimenSplit
from ...core.units import quantity
from .braid import BraidSize, read_braid
from .declaration import RequestError, Where, option, request

PURPOSES: Mapping[str, GroupSplit | None] = {"repeat": RunSplit(), "length": SpecimenSplit(), "both": None}
"""Purposes with the split that serves each: further runs of the measured muscles, other muscles, or both."""
SPLITS: Mapping[str, GroupSplit] = {
    "run": RunSplit(),
    "specimen": SpecimenSplit(),
    "contraction": LevelSplit("contraction"),
    "pressure": LevelSplit("pressure"),
    "block": BlockSplit(),
}
"""Groups of rows that are left out in turn."""
SPLIT_NAMES = (
    ("", "automatic"), ("run", "one run at a time"), ("specimen", "one specimen at a time"),
    ("contraction", "one level of contraction"), ("pressure", "one level of pressure"),
    ("block", "blocks within each run"),
)  # fmt: skip
"""Their names in a form."""
WEAK = "weak"
"""Name in place of a parameter that stands for all weakly determined ones."""


def read_free_contraction(text: str, where: str) -> tuple[float, float]:
    """A point of zero force: pressure [Pa] and contraction [1]. Raises RequestError or UnitError."""
    pressure, sign, contraction = text.partition("=")
    if not sign:
        raise RequestError(f"{where} must be PRESSURE=CONTRACTION, such as '3 bar=18 %', not '{text}'")
    value = quantity(contraction, "1", where=where)
    if not 0.0 <= value < 1.0:
        raise RequestError(f"{where}: a contraction must be from 0 to 100 %, not '{contraction}'")
    return quantity(pressure, "Pa", where=where), value


@request
class FitRequest:
    """What a static fit is asked for."""

    characteristic: str | None = option(
        "Initial law: a library entry, a muscle file (TOML), or a model that needs no initial values, such as "
        "ContractileSurface.",
        default=None,
    )
    compare: bool = option("Fit every characteristic that the data determine, and rank them.", default=False)
    leave_out: GroupSplit | None = option(
        "Groups of rows for cross-validation (--compare) and resampling (--bootstrap): run, specimen, contraction, "
        "pressure, block.",
        choices=SPLITS,
        default=None,
        metavar="GROUP",
        label="Cross-validation leaves out",
        offered=SPLIT_NAMES,
    )
    purpose: str | None = option(
        "Use of the law that --compare recommends: repeat (further runs of the measured muscles), length (other "
        "muscles of the type), both (one law for both). Default: both, if three specimens or more were each measured "
        "in several runs.",
        choices=tuple(PURPOSES),
        default=None,
        metavar="PURPOSE",
    )
    bootstrap: int | None = option(
        "Bootstrap with N refits to resampled groups of rows.", default=None, bounds=(20, 100_000)
    )
    profile: tuple[str, ...] = option(
        "Profile-likelihood interval of this parameter; 'weak': of all weakly determined ones. Repeatable.",
        default=(),
        metavar="PARAMETER",
    )
    length_error: tuple[str, ...] = option(
        "Estimate the error of the recorded resting length of this specimen together with the law. Repeatable.",
        default=(),
        metavar="SPECIMEN",
    )
    shape: bool = option(
        "Constrain a ContractileSurface: force must not decrease with pressure nor increase with contraction.",
        default=False,
    )
    free_contraction: tuple[Any, ...] = option(
        "With --shape: a point of zero force (free contraction), such as '3 bar=18 %'. Repeatable.",
        default=(),
        metavar="PRESSURE=CONTRACTION",
        read=read_free_contraction,
    )
    braid: BraidSize | None = option(
        "Braid at rest, such as 'radius=10 mm, angle=24.4 deg' (outer radius; angle between threads and axis): the "
        "[geometry] of a muscle whose law contains none. Requires the resting length.",
        default=None,
        metavar="SIZE",
        read=read_braid,
    )
    degree: int = option("Total degree of a ContractileSurface.", default=5, bounds=(1, 9))
    fix: tuple[str, ...] = option(
        "Keep this parameter at its initial value; repeatable.", default=(), metavar="PARAMETER"
    )
    robust: str | None = option(
        "Threshold of the Huber loss, such as '10 N' or '0.5 %'; default: squared. With --compare: a force.",
        default=None,
        metavar="QUANTITY",
    )
    uncensored: bool = option("Fit rows at zero force as measured values, not as censored data.", default=False)
    equal_weights: bool = option("Equal weights; default: by the sensor resolution of each test rig.", default=False)

    def check(self, where: Where) -> None:
        """Raise RequestError for fields that do not fit together."""
        if self.characteristic is None and not self.compare:
            raise RequestError(
                f"give the characteristic to fit with {where('characteristic')}, or rank all with {where('compare')}"
            )
        if self.free_contraction and not self.shape:
            raise RequestError(f"{where('free_contraction')} requires {where('shape')}")
        if self.shape and self.compare:
            raise RequestError(
                f"{where('shape')} is for a ContractileSurface, given with {where('characteristic')}; it excludes "
                f"{where('compare')}"
            )
        if self.purpose is not None and (not self.compare or self.leave_out is not None):
            raise RequestError(f"{where('purpose')} is for {where('compare')}, and excludes {where('leave_out')}")
        if self.compare and (self.uncensored or self.equal_weights):
            raise RequestError(
                f"{where('compare')} ranks by errors of rows with positive force: {where('uncensored')} and "
                f"{where('equal_weights')} do not apply"
            )

    @property
    def split(self) -> GroupSplit | None:
        """The groups of rows that are left out; None for both purposes."""
        return self.leave_out if self.purpose is None else PURPOSES[self.purpose]

    def loss(self, unit: str) -> Loss:
        """The loss, with its threshold in this SI unit. Raises UnitError."""
        return LeastSquares() if self.robust is None else Huber(quantity(self.robust, unit, where="--robust"))
