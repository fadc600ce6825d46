"""characteristic."""
