/* Root search: the smallest root on a grid of 256 intervals, as the library searches it, refined by Chandrupatla's
   method (Advances in Engineering Software 28:145, 1997) to the resolution of floating-point numbers. */
"use strict";

(() => {
  const INTERVALS = 256;

  /* Root of f in [a, b] with f(a) < 0 <= f(b). */
  function refine(f, a, fa, b, fb) {
    if (fb === 0) {
      if (f((a + b) / 2) !== 0) return b;
      return edge(f, a, b);
    }
    let x1 = b, f1 = fb, x2 = a, f2 = fa, x3 = a, f3 = fa, t = 0.5;
    for (let i = 0; i < 200; i++) {
      const x = x1 + t * (x2 - x1), fx = f(x);
      if (Number.isNaN(fx)) return NaN;
      if (Math.sign(fx) === Math.sign(f1)) { x3 = x1; f3 = f1; } else { x3 = x2; f3 = f2; x2 = x1; f2 = f1; }
      x1 = x; f1 = fx;
      const best = Math.abs(f2) < Math.abs(f1) ? x2 : x1, fbest = Math.abs(f2) < Math.abs(f1) ? f2 : f1;
      const tolerance = 2 * Number.EPSILON * Math.abs(best) + 1e-300, share = tolerance / Math.abs(x2 - x1);
      if (share > 0.5 || fbest === 0) return best;
      const xi = (x1 - x2) / (x3 - x2), phi = (f1 - f2) / (f3 - f2);
      t = phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi
        ? f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2) : 0.5;
      t = Math.min(1 - share, Math.max(share, t));
    }
    return x1;
  }

  /* The point from which on f is not negative, where f is zero on a whole interval (a clamped force). */
  function edge(f, a, b) {
    for (let i = 0; i < 200 && b - a > 2 * Number.EPSILON * Math.abs(b); i++) {
      const middle = a + (b - a) / 2;
      if (f(middle) >= 0) b = middle; else a = middle;
    }
    return b;
  }

  /* The smallest x in [low, high] at which f changes from negative to zero or positive; NaN without one. */
  function firstRoot(f, low, high) {
    const step = (high - low) / INTERVALS;
    let left = low, before = f(low);
    if (before === 0) return low;
    for (let i = 1; i <= INTERVALS; i++) {
      const right = i < INTERVALS ? low + i * step : high, at = f(right);
      if (before < 0 && at >= 0) return refine(f, left, before, right, at);
      left = right; before = at;
    }
    return NaN;
  }

  Object.assign(airmuscle, { firstRoot });
})();
