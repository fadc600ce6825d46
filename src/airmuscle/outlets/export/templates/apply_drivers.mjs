      apply_drivers(kinds, settings, driverStates, driverStates, signals, counts, scratch, begin, ulp(end));
