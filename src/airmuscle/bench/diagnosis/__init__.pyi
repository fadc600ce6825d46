from .branch_residuals import DELAY as DELAY
from .branch_residuals import EITHER as EITHER
from .branch_residuals import FILTER as FILTER
from .branch_residuals import delay_notes as delay_notes
from .branch_residuals import find_delay as find_delay
from .checked_reading import check_bench as check_bench
from .checked_reading import complete_bench as complete_bench
from .checked_reading import read as read
from .data_checks import Scatter as Scatter
from .level_records import LevelRecord as LevelRecord
from .level_records import level_record as level_record
from .level_records import level_tables as level_tables
from .misfit import MAX_ACCEPTED as MAX_ACCEPTED
from .misfit import LawMisfit as LawMisfit
from .misfit import misfit_warning as misfit_warning
from .support import DataUse as DataUse
from .support import Support as Support
from .support import support_of as support_of
from .suspicious_values import find_suspicious as find_suspicious
from .suspicious_values import warn_of_suspicious_values as warn_of_suspicious_values

# isort: split
# For the other rooms, not in __all__
from .branch_residuals import branch_distance as branch_distance
from .branch_residuals import branch_notes as branch_notes
from .contractions import MAX_CONTRACTION as MAX_CONTRACTION
from .contradictions import RepeatedRows as RepeatedRows
from .contradictions import find_repeated_rows as find_repeated_rows
from .data_checks import HELD as HELD
from .data_checks import Remarks as Remarks
from .data_checks import check_data as check_data
from .data_checks import force_noise as force_noise
from .data_checks import level_text as level_text
from .matched_rows import match_rows as match_rows
