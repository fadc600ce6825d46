from ..estimation import specimens_of as specimens_of
from .candidate_scores import FoldScore as FoldScore
from .comparison_chapter import LawSelection as LawSelection
from .comparison_chapter import compare_chapters as compare_chapters
from .comparison_chapter import select_for_both as select_for_both
from .model_selection import Comparison as Comparison
from .model_selection import compare as compare
from .model_selection import eligible_models as eligible_models
from .model_selection import excess_error as excess_error
from .model_selection import recommend as recommend
from .result_chapter import error_interval as error_interval
from .specimen_errors import SpecimenErrors as SpecimenErrors
from .specimen_errors import odd_specimen_notes as odd_specimen_notes
from .specimen_errors import specimen_notes as specimen_notes

# isort: split
# For the other rooms, not in __all__
from .candidate_scores import RankedModel as RankedModel
from .compared_points import ComparedPoints as ComparedPoints
from .compared_points import force_residuals as force_residuals
from .compared_points import law_of_length as law_of_length
from .comparison_chapter import compare_chapter as compare_chapter
from .comparison_chapter import select_law as select_law
from .specimen_errors import ranked_specimen_errors as ranked_specimen_errors
