"""Library: parameter sets of muscles, laws and valves as TOML files, with sources and checks."""
