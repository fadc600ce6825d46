  const {kinds, settings} = loop.drivers;
  const driverStates = loop.drivers.states.map((state) => [...state]);
  const scratch = [[[], [], []], [[], [], []]];
