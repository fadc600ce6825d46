"""Instruction lists: recording from CasADi, elimination, sparse LU, branches, scheduling."""
