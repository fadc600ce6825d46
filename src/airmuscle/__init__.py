"""airmuscle."""
