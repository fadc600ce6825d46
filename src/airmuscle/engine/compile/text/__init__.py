"""Source text of printed functions in languages of users: C99, JavaScript, MATLAB and Octave."""
