"""The three papers, each reproduced claim by claim in a file of its own, and what runs them."""

from .run import PAPERS as PAPERS
from .run import reproduce as reproduce
