from .commands import COMMANDS as COMMANDS
from .commands import app as app
from .entry_point import main as main
