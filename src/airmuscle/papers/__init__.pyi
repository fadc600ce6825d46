from .run import PAPERS as PAPERS
from .run import chapter_texts as chapter_texts
from .run import reproduce as reproduce
