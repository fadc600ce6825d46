"""Ctrl-C interrupts here too, where a shell that runs the tests in the background has it ignored."""

import signal

signal.signal(signal.SIGINT, signal.default_int_handler)
