def set_parameters(self, values):
    """Set parameters by path: numbers, or tensors of the shape of the batch (differentiable)."""
    unknown = [path for path in values if path not in PARAMETERS]
    if unknown:
        raise KeyError(f"there is no parameter {unknown[0]!r}; there are {', '.join(PARAMETERS)}")
    rows = [self.values[i] for i in range(len(PARAMETERS))]
    for path, value in values.items():
        rows[PARAMETERS.index(path)] = self._within_bounds(path, value)
    self.values = stacked(rows, self.defaults)
    self.prepared = prepare(self.values)

def _within_bounds(self, path, value):
    """A parameter as a tensor; raises ValueError beyond its bounds, and for NaN."""
    value = torch.as_tensor(value, dtype=self.defaults.dtype, device=self.defaults.device)
    i = PARAMETERS.index(path)
    refused = ~((value >= self.lower[i]) & (value <= self.upper[i]))
    if refused.any():
        raise ValueError(f"{path} is {value[refused][0].item():.6g}; allowed are {LOWER[i]:.6g} to {UPPER[i]:.6g}")
    return value

def _load_from_state_dict(self, state_dict, prefix, *arguments):
    """Parameters of a stored actuator are common to all muscles, or of each: take over their shape."""
    for name in ("values", "prepared"):
        stored, present = state_dict.get(prefix + name), getattr(self, name)
        if stored is not None and self._fits(stored):
            setattr(self, name, present.new_empty(stored.shape))
    super()._load_from_state_dict(state_dict, prefix, *arguments)

def _fits(self, rows):
    """Whether each of these rows belongs to all muscles or to a batch of this shape."""
    shape = rows.shape[1:]
    return len(shape) <= len(self.shape) and all(n in (1, m) for n, m in zip(shape[::-1], self.shape[::-1]))

def randomise(self, scale=1.0, generator=None):
    """Draw the identified parameters of every muscle from their covariance, within their bounds.

    Raises ValueError without a covariance.
    """
    if not IDENTIFIED:
        raise ValueError(NO_COVARIANCE)
    kind = {"dtype": self.defaults.dtype, "device": self.defaults.device}
    normal = torch.randn((self.spread.shape[1], *self.shape), generator=generator, **kind)
    deviations = scale * torch.tensordot(self.spread, normal, dims=1)
    drawn = {}
    for path, deviation in zip(IDENTIFIED, deviations):
        i = PARAMETERS.index(path)
        drawn[path] = torch.clamp(self.defaults[i] + deviation, self.lower[i], self.upper[i])
    self.set_parameters(drawn)
