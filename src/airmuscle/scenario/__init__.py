"""Scenario files: plants, commands, runs and dynamic fits as TOML."""
