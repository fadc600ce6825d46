/* Law: the printed functions of a characteristic with its present parameters. Pressure is gauge [Pa], contraction is a
   ratio, force [N] pulls. What has no solution is NaN. */
"use strict";

(() => {
  const STEP = 1e-6;   /* of a slope beyond the range, where the force is linear in the contraction */

  class Law {
    constructor(sheet) {
      this.sheet = sheet;
      this.program = airmusclePrograms[sheet.id];
      this.values = Float64Array.from(sheet.values);
      this.held = new Float64Array(sheet.held + 1);
      this.x = new Float64Array(2);
      this.f = new Float64Array(3);
      this.range = new Float64Array(6);
      this.prepare();
    }

    /* To be called after every change of `values`. */
    prepare() {
      this.program.prepare(this.values, this.held);
      this.limits = null;
      if (this.program.limits) this.program.limits(this.held, this.range);
      else this.range.set(this.sheet.limits);
    }

    get pressureRange() { return [this.range[0], this.range[1]]; }
    get contractionRange() { return [this.range[2], this.range[3]]; }
    get forceRange() { return [this.range[4], this.range[5]]; }

    get restingLength() {
      const index = this.sheet.resting_length;
      return index === null ? null : this.values[index];
    }

    get isChanged() { return this.values.some((v, i) => v !== this.sheet.values[i]); }

    printed(name, a, b) {
      this.x[0] = a; this.x[1] = b;
      this.program[name](this.x, this.held, this.f);
      return this.f[0];
    }

    force(pressure, contraction) {
      if (this.program.force) return this.printed("force", pressure, contraction);
      return this.sheet.beyond ? airmuscle.extendedForce(this, pressure, contraction) : this.formulaForce(pressure, contraction);
    }

    contraction(pressure, force) {
      const formula = this.formulaContraction(pressure, force), { beyond } = this.sheet;
      if (!beyond || airmuscle.holds(this, pressure, formula, force)) return formula;
      return airmuscle.firstRoot((c) => force - this.force(pressure, c), ...beyond.searched);
    }

    pressure(contraction, force) {
      const formula = this.formulaPressure(contraction, force);
      if (!this.sheet.beyond || airmuscle.holds(this, formula, contraction, force)) return formula;
      return airmuscle.firstRoot((p) => this.force(p, contraction) - force, ...this.pressureRange);
    }

    /* The limits of the force beyond the range, with the present parameters. */
    forceLimits() {
      return this.limits ??= airmuscle.forceLimits(this);
    }

    formulaForce(pressure, contraction) {
      const [low, high] = this.forceRange;
      if (this.sheet.kind === "contraction") {
        return airmuscle.firstRoot((f) => contraction - this.printed("contraction", pressure, f), low, high);
      }
      return airmuscle.firstRoot((f) => this.printed("pressure", contraction, f) - pressure, low, high);
    }

    formulaContraction(pressure, force) {
      const [low, high] = this.contractionRange;
      if (this.program.contraction) return within(this.printed("contraction", pressure, force), low, high, this.sheet.kind === "contraction");
      if (this.sheet.kind === "pressure") {
        return airmuscle.firstRoot((c) => this.printed("pressure", c, force) - pressure, low, high);
      }
      return airmuscle.firstRoot((c) => force - this.force(pressure, c), low, high);
    }

    formulaPressure(contraction, force) {
      const [low, high] = this.pressureRange;
      if (this.program.pressure) return within(this.printed("pressure", contraction, force), low, high, this.sheet.kind === "pressure");
      if (this.sheet.kind === "contraction") {
        return airmuscle.firstRoot((p) => this.printed("contraction", p, force) - contraction, low, high);
      }
      return airmuscle.firstRoot((p) => this.force(p, contraction) - force, low, high);
    }

    /* The third of three quantities, given two. */
    solve(missing, point) {
      if (missing === "force") return this.force(point.pressure, point.contraction);
      if (missing === "contraction") return this.contraction(point.pressure, point.force);
      return this.pressure(point.contraction, point.force);
    }

    /* -dF/deps at constant pressure [N]. */
    stiffness(pressure, contraction) {
      if (this.program.force) { this.printed("force", pressure, contraction); return -this.f[2]; }
      const { beyond } = this.sheet;
      if (!beyond || (contraction >= beyond.begin && contraction <= beyond.end)) return this.formulaStiffness(pressure, contraction);
      return (this.force(pressure, contraction - STEP) - this.force(pressure, contraction + STEP)) / (2 * STEP);
    }

    formulaStiffness(pressure, contraction) {
      const force = this.formulaForce(pressure, contraction);
      if (Number.isNaN(force)) return NaN;
      if (this.sheet.kind === "contraction") { this.printed("contraction", pressure, force); return -1 / this.f[2]; }
      this.printed("pressure", contraction, force);
      return this.f[1] / this.f[2];
    }

    /* Forces of one isobar at contractions, into `forces`. */
    isobar(pressure, contractions, forces) {
      const n = contractions.length;
      if (this.program.force) {
        const { x, f, held } = this, evaluate = this.program.force;
        x[0] = pressure;
        for (let i = 0; i < n; i++) { x[1] = contractions[i]; evaluate(x, held, f); forces[i] = f[0]; }
      } else {
        const every = n > 200 ? Math.ceil(n / 200) : 1;   /* a root search each: fewer points, with gaps that uPlot spans */
        for (let i = 0; i < n; i++) forces[i] = i % every && i !== n - 1 ? null : this.force(pressure, contractions[i]);
      }
      for (let i = 0; i < n; i++) if (Number.isNaN(forces[i])) forces[i] = null;
      return forces;
    }

    /* Outline of the muscle at a contraction: axial positions from the middle and radii [m]; null without a geometry. */
    outline(contraction, points = 48) {
      const shape = this.sheet.geometry;
      if (!shape) return null;
      const at = Math.min(shape.range[1], Math.max(shape.range[0], contraction));
      if (!this.program.outline) return sampledOutline(shape, at);
      const axial = [], radius = [], chord = this.restingLength / shape.segments * (1 - at);
      for (let s = 0; s < shape.segments; s++) {
        const middle = (s - (shape.segments - 1) / 2) * chord, count = Math.max(8, Math.round(points / shape.segments));
        for (let i = 0; i <= count; i++) {
          this.printed("outline", at, 2 * i / count - 1);
          axial.push(this.f[0] + middle); radius.push(this.f[1]);
        }
      }
      return { axial, radius };
    }

    /* Text of a muscle file with the present parameters. */
    toml() {
      const { unchanged, changed } = this.sheet.toml;
      return this.isChanged ? airmuscle.fillTemplate(changed, this.values) : unchanged;
    }
  }

  /* A closed form is valid within the search range of the library only; the direction of the paper is not limited. */
  function within(value, low, high, unlimited) {
    return unlimited || (value >= low && value <= high) ? value : NaN;
  }

  function sampledOutline(shape, contraction) {
    const grid = shape.contractions, last = grid.length - 1;
    const place = Math.min(last, Math.max(0, (contraction - grid[0]) / (grid[last] - grid[0]) * last));
    const i = Math.min(last - 1, Math.floor(place)), t = place - i;
    const mix = (rows) => rows[i].map((v, k) => v + t * (rows[i + 1][k] - v));
    return { axial: mix(shape.axial), radius: mix(shape.radius) };
  }

  Object.assign(airmuscle, { Law });
})();
