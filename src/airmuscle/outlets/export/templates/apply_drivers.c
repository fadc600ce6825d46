  apply_drivers(driver_kinds, driver_settings, driver_states, driver_states, signals, counts,
                scratch, begin, nextafter(fabs(end), HUGE_VAL) - fabs(end));
