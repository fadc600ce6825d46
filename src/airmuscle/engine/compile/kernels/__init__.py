"""Fixed kernels: compiled once per machine, they take the functions of a program as addresses. No
physics here.
"""
