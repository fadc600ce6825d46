"""Static characteristics: relations between gauge pressure, contraction and tension; one class per paper."""

from .base import Characteristic, Clamped, ContractionLaw, ForceLaw, PressureLaw
from .borzikova import SAM_30X290, BorzikovaDirect, BorzikovaExponential
from .chou_hannaford1996 import ChouHannaford1996
from .contractile_surface import ContractileSurface, exponents
from .effective_length import EffectiveLength
from .energy_defect import maxwell_defect, virtual_work_defect
from .exact_meridian import ExactMeridian
from .hunt2017 import Hunt2017
from .length_family import InverseLength, LogarithmicLength
from .martens_boblan2017 import MartensBoblan2017
from .polynomial_surrogate import PolynomialSurrogate, as_force_law
from .pooled_length_law import PooledLengthLaw
from .reynolds2003 import Reynolds2003
from .rubber import ArcIntegral, AxialIntegral, RubberLine
from .saga2007 import LINE_A, LINE_B, Saga2007
from .sarosi2012 import Sarosi2012
from .serres2009 import Serres2009
from .tabulated import Tabulated
from .tondu_lopez2000 import TonduLopez2000
from .validity_range import ValidityRange
from .virtual_work import CircleVirtualWork, VirtualWork

__all__ = [
    "LINE_A",
    "LINE_B",
    "SAM_30X290",
    "ArcIntegral",
    "AxialIntegral",
    "BorzikovaDirect",
    "BorzikovaExponential",
    "Characteristic",
    "ChouHannaford1996",
    "CircleVirtualWork",
    "Clamped",
    "ContractileSurface",
    "ContractionLaw",
    "EffectiveLength",
    "ExactMeridian",
    "ForceLaw",
    "Hunt2017",
    "InverseLength",
    "LogarithmicLength",
    "MartensBoblan2017",
    "PolynomialSurrogate",
    "PooledLengthLaw",
    "PressureLaw",
    "Reynolds2003",
    "RubberLine",
    "Saga2007",
    "Sarosi2012",
    "Serres2009",
    "Tabulated",
    "TonduLopez2000",
    "ValidityRange",
    "VirtualWork",
    "as_force_law",
    "exponents",
    "maxwell_defect",
    "virtual_work_defect",
]
