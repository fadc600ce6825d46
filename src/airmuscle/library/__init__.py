"""The catalogue: one TOML per specimen or paper, with its sources and its checks."""
