static int driver_kinds[DRIVERS][2] = {@kinds@};
static double driver_settings[DRIVERS][4] = {@settings@};
static double driver_states[DRIVERS][4] = {@states@};
static double scratch[2][3][CAPACITY];
