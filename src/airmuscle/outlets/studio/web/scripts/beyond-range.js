/* Force of a law beyond its range, of one that is not printed as a force: stretched sleeve, slack muscle, greatest force,
   as `extended_force` of the library has them. */
"use strict";

(() => {
  const OVERLOAD = 1.5, LEAST_RATED = 1e-3, CLOSE = 1e-9;

  const clip = (value, low, high) => Math.min(high, Math.max(low, value));

  /* The force of the formula; zero above the beginning of the range where it has none, because the muscle is slack. */
  function formulaOrSlack(law, pressure, contraction, begin) {
    const force = law.formulaForce(pressure, contraction);
    return Number.isNaN(force) && contraction > begin ? 0 : force;
  }

  /* Greatest force at the corners of the range, the rated force, and the limit of the force beyond the range [N]. */
  function forceLimits(law) {
    const { begin, end, pressures, permitted } = law.sheet.beyond;
    let greatest = LEAST_RATED;
    for (const p of pressures ?? law.pressureRange) for (const c of [begin, end]) {
      const force = formulaOrSlack(law, p, c, begin);
      if (force > greatest) greatest = force;
    }
    const rated = permitted === null ? greatest : Math.max(permitted, LEAST_RATED);
    if (pressures) return { rated, limit: Math.max(OVERLOAD * rated, greatest) };
    return { rated, limit: permitted === null ? Infinity : OVERLOAD * rated };
  }

  function extendedForce(law, pressure, contraction) {
    const { begin, end, pressures } = law.sheet.beyond;
    const inner = clip(contraction, begin, end), inside = inner === contraction;
    if (inside && pressures && pressure >= pressures[0] && pressure <= pressures[1]) return law.formulaForce(pressure, inner);
    const { rated, limit } = law.forceLimits();
    let added = 0;
    if (contraction < begin) added = Math.max(law.formulaStiffness(pressure, begin), 0) * (begin - contraction);
    else if (!inside) added = rated / (end - begin) * (end - contraction);
    if (!pressures) added = Math.min(added, (OVERLOAD - 1) * rated);
    return Math.max(Math.min(formulaOrSlack(law, pressure, inner, begin) + added, limit), 0);
  }

  /* Whether a law has this force at a point, to rounding: a solution of the formula beyond the range is none of the law. */
  function holds(law, pressure, contraction, force) {
    return Math.abs(law.force(pressure, contraction) - force) <= CLOSE * Math.max(1, Math.abs(force));
  }

  /* What a law is at a point outside its validity range, in the words of the documentation of the contract. */
  function textBeyond({ sheet: { beyond } }, { contraction, force }) {
    if (!beyond) return "the law is not continued there";
    if (contraction < beyond.begin) return "a stretched sleeve, with the stiffness of the law at the beginning of the range";
    if (contraction > beyond.end) return force > 0 ? "the force falls with the mean stiffness to zero" : "the muscle is slack";
    return "the formula of the law, at most 1.5 times the rated force";
  }

  Object.assign(airmuscle, { extendedForce, forceLimits, holds, textBeyond });
})();
