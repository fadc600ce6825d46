"""Source text of printed functions: C99, JavaScript, MATLAB and Octave, PyTorch, Warp."""
