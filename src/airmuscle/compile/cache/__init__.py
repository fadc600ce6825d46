"""Cache of compiled kernels: machine code kept as files, loaded without numba."""
