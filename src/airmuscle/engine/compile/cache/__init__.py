"""Cache of compiled kernels: machine code stored in files and loaded without numba."""
