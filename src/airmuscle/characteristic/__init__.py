"""Static laws: what binds gauge pressure, contraction and tension. One paper, one file, one class."""

from .as_force_law import as_force_law as as_force_law
from .base import Characteristic as Characteristic
from .base import ContractionLaw as ContractionLaw
from .base import ForceLaw as ForceLaw
from .base import PressureLaw as PressureLaw
from .borzikova import BorzikovaDirect as BorzikovaDirect
from .borzikova import BorzikovaExponential as BorzikovaExponential
from .box import Box as Box
from .chou_hannaford1996 import ChouHannaford1996 as ChouHannaford1996
from .circle_virtual_work import CircleVirtualWork as CircleVirtualWork
from .clamped import Clamped as Clamped
from .contractile_surface import ContractileSurface as ContractileSurface
from .effective_length import EffectiveLength as EffectiveLength
from .exact_meridian import ExactMeridian as ExactMeridian
from .hunt2017 import Hunt2017 as Hunt2017
from .length_family import InverseLength as InverseLength
from .length_family import LogarithmicLength as LogarithmicLength
from .martens_boblan2017 import MartensBoblan2017 as MartensBoblan2017
from .reynolds2003 import Reynolds2003 as Reynolds2003
from .rubber import RubberLine as RubberLine
from .saga2007 import Saga2007 as Saga2007
from .sarosi2012 import Sarosi2012 as Sarosi2012
from .serres2009 import Serres2009 as Serres2009
from .tabulated import Tabulated as Tabulated
from .tondu_lopez2000 import TonduLopez2000 as TonduLopez2000
from .virtual_work import VirtualWork as VirtualWork
