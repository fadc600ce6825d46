  states = loop.drivers.states;
  scratch = {zeros(3, 0), zeros(3, 0)};
