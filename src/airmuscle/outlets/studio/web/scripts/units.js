/* Units of choice: those in which the tab Muscle shows and reads pressures, forces and lengths. A factor is the size of
   the unit in SI. */
"use strict";

(() => {
  const POUND_FORCE = 4.4482216152605, INCH = 0.0254, NEWTON = { name: "N", factor: 1 };
  const METRIC = { force: NEWTON, length: { name: "mm", factor: 1e-3 }, volume: { name: "cm³", factor: 1e-6 } };
  const SYSTEMS = {
    "bar, N, mm": { pressure: { name: "bar", factor: 1e5 }, ...METRIC },
    "kPa, N, mm": { pressure: { name: "kPa", factor: 1e3 }, ...METRIC },
    "MPa, N, mm": { pressure: { name: "MPa", factor: 1e6 }, ...METRIC },
    "psi, lbf, in": {
      pressure: { name: "psi", factor: POUND_FORCE / INCH ** 2 }, force: { name: "lbf", factor: POUND_FORCE },
      length: { name: "in", factor: INCH }, volume: { name: "in³", factor: INCH ** 3 },
    },
  };
  const PERCENT = { name: "%", factor: 0.01 };

  const units = {
    systems: Object.keys(SYSTEMS),

    choose(system) {
      if (!SYSTEMS[system]) return;
      Object.assign(units, SYSTEMS[system], { system, contraction: PERCENT });
    },

    /* A quantity in its unit of choice as a text: text("pressure", 3e5) is "3 bar". */
    text(quantity, value, digits = 4) { return `${airmuscle.shortText(value / units[quantity].factor, digits)} ${units[quantity].name}`; },
  };
  units.choose("bar, N, mm");

  Object.assign(airmuscle, { units });
})();
