def _array(self, rows, values=None):
    filled = np.zeros((max(rows, 1), self.count)) if values is None else values
    return wp.array(np.ascontiguousarray(filled), dtype=real, device=self.device)

def _launch(self, kernel, *arguments):
    wp.launch(kernel, dim=self.count, inputs=arguments, device=self.device)

def prepare(self):
    """Take over the parameters after they were changed."""
    self._launch(prepare, self.parameters, self.prepared)

def set_parameters(self, values):
    """Set parameters by path: numbers, or arrays (count,). Raises ValueError beyond their bounds, and for NaN."""
    unknown = [path for path in values if path not in PARAMETERS]
    if unknown:
        raise KeyError(f"there is no parameter {unknown[0]!r}; there are {', '.join(PARAMETERS)}")
    rows = self.parameters.numpy()
    for path, value in values.items():
        i, value = PARAMETERS.index(path), np.asarray(value, dtype=float)
        refused = ~((value >= LOWER[i]) & (value <= UPPER[i]))
        if refused.any():
            raise ValueError(f"{path} is {value[refused][0]:.6g}; allowed are {LOWER[i]:.6g} to {UPPER[i]:.6g}")
        rows[i] = value
    self.parameters.assign(rows)
    self.prepare()

def randomise(self, scale=1.0, seed=None):
    """Draw the identified parameters of every muscle from their covariance, within their bounds.

    Raises ValueError without a covariance.
    """
    if not IDENTIFIED:
        raise ValueError(NO_COVARIANCE)
    root = np.array(SPREAD, dtype=float).reshape(len(IDENTIFIED), -1)
    deviations = scale * root @ np.random.default_rng(seed).standard_normal((root.shape[1], self.count))
    values = self.parameters.numpy()
    for path, deviation in zip(IDENTIFIED, deviations):
        i = PARAMETERS.index(path)
        values[i] = np.clip(DEFAULTS[i] + deviation, LOWER[i], UPPER[i])
    self.parameters.assign(values)
    self.prepare()
