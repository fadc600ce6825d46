"""Surfaces that a muscle can have: an exponential one, and conditions on slopes over a whole validity range."""
