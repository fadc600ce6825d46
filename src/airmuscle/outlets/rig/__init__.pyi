from .mcap_file import mcap_bytes as mcap_bytes
from .plan_files import c_table as c_table
from .plan_files import signal_files as signal_files
