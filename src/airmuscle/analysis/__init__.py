"""Analysis of a plant: equilibria and their stability, stiffness, linearisation, energy consistency."""
