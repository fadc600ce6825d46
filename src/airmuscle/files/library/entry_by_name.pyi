from pathlib import Path
from typing import Literal, overload

from .any_entry import AnyEntry
from .entry import Entry
from .plant_entry import PlantEntry
from .product_entry import ProductEntry
from .valve_entry import ValveEntry

@overload
def load(
    name_or_path: Literal[
        "borzikova-direct-printed",
        "borzikova-direct-repaired",
        "borzikova-exponential",
        "borzikova-monotone",
        "braided-silicone-9mm",
        "chou-hannaford",
        "dmsp-10-250",
        "dmsp-20-300",
        "festo-tool-dmsp-10",
        "festo-tool-dmsp-20",
        "festo-tool-dmsp-40",
        "hunt2017-festo-10",
        "reynolds2003",
        "saga2007",
        "saga2007-circle",
        "saga2007-exact",
        "sarosi-dmsp-10",
        "sarosi-dmsp-20-200n",
        "sarosi-dmsp-20-400n",
        "serres2009",
        "tondu-lopez",
    ],
) -> Entry: ...
@overload
def load(
    name_or_path: Literal[
        "ckd-m4ga1-r",
        "ckd-m4ga2-r",
        "ckd-m4ga3-r",
        "ckd-m4gb1-r",
        "ckd-m4gb2-r",
        "festo-mh2",
        "matrix-821",
        "smc-ak2000-01",
        "smc-sx090",
        "smc-sx91",
        "smc-sx92",
        "smc-sy3000",
        "smc-sy5000",
        "smc-sy7000",
        "smc-sy9000",
    ],
) -> ValveEntry: ...
@overload
def load(
    name_or_path: Literal[
        "arm-lilly-quesada",
        "joint-dmsp-20-itv2050",
        "joint-dmsp-20-matrix",
        "joint-dmsp-20-proportional",
        "joint-dmsp-20-regulators",
        "joint-sam-30x290",
        "joint-straight-fibre",
        "lift-dmsp-20",
        "vessel-smc-itv2050",
    ],
) -> PlantEntry: ...
@overload
def load(
    name_or_path: Literal[
        "festo-dmsp-10",
        "festo-dmsp-20",
        "festo-dmsp-40",
        "shadow-20-210",
        "shadow-30-290",
        "shadow-6-150",
    ],
) -> ProductEntry: ...
@overload
def load(name_or_path: str | Path) -> AnyEntry: ...
