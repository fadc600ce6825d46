"""Scenario files: a plant, its inputs and a run in TOML; dynamic identification from such a file."""
