"""Surface fits: exponential surface of Borzíková et al., monotone and shape-constrained fits."""
