/* Points of a user: pressure, contraction or length, and force, as CSV or as cells pasted from a spreadsheet; and their
   residuals about a law. */
"use strict";

(() => {
  const PRESSURES = { Pa: 1, kPa: 1e3, MPa: 1e6, mbar: 100, bar: 1e5, psi: 6894.757293168361 };
  const LENGTHS = { m: 1, cm: 1e-2, mm: 1e-3, in: 0.0254 };
  const FORCES = { N: 1, kN: 1e3, lbf: 4.4482216152605, kgf: 9.80665 };
  const QUANTITIES = [
    ["pressure", /^(gauge )?press|^p$/i, PRESSURES], ["contraction", /contraction|strain|^eps/i, { "%": 0.01, 1: 1, "-": 1 }],
    ["length", /length|^L$/i, LENGTHS], ["force", /force|tension|load|^F$/i, FORCES],
  ];
  const EXAMPLE = "pressure [bar]; contraction [%]; force [N]", MOST = 2000;

  function readHeading(text) {
    const [, words, unit] = /^\s*"?([^[(]*?)\s*(?:[[(]\s*([^\])]*?)\s*[\])])?"?\s*$/.exec(text) ?? [null, text, undefined];
    const row = QUANTITIES.find(([, pattern]) => pattern.test(words.trim()));
    if (!row) return null;
    const [quantity, , allowed] = row, factor = allowed[unit];
    if (factor === undefined) throw new Error(`The heading “${text.trim()}” states ${unit ? `the unit ${unit}` : "no unit"}; write ${words.trim()} with one of ${Object.keys(allowed).map((name) => `[${name}]`).join(", ")}.`);
    return { quantity, factor };
  }

  /* Points {pressure, contraction, force} in SI. restingLength [m] converts lengths; null where the muscle has none. */
  function readPoints(text, restingLength) {
    const lines = text.split(/\r?\n/).map((line, i) => ({ line, number: i + 1 })).filter(({ line }) => line.trim() && !line.startsWith("#"));
    if (lines.length < 2) throw new Error(`There are no points; write a line with the headings, such as ${EXAMPLE}, and a line for each point.`);
    const first = lines[0].line, separator = ["\t", ";", ","].find((sign) => first.includes(sign)) ?? ",";
    const columns = first.split(separator).map(readHeading), place = (name) => columns.findIndex((column) => column?.quantity === name);
    const axial = place("contraction") >= 0 ? "contraction" : "length", needed = ["pressure", axial, "force"];
    const missing = needed.filter((name) => place(name) < 0);
    if (missing.length) throw new Error(`No heading names the ${missing.map((name) => (name === "length" ? "contraction or length" : name)).join(" and the ")}; the first line must have the form ${EXAMPLE}.`);
    if (axial === "length" && !restingLength) throw new Error("This law states no resting length, by which lengths would become contractions; give a column contraction [%].");
    if (lines.length > MOST + 1) throw new Error(`There are ${lines.length - 1} points; at most ${MOST} are drawn. Thin them out, or use airmuscle fit.`);
    return lines.slice(1).map(({ line, number }) => {
      const cells = line.split(separator);
      const [pressure, value, force] = needed.map((name) => {
        const cell = (cells[place(name)] ?? "").trim(), read = airmuscle.readNumber(cell);
        if (Number.isNaN(read)) throw new Error(`Line ${number}: “${cell.slice(0, 40)}” is no number; a ${name} is expected. Correct the line or remove it.`);
        return read * columns[place(name)].factor;
      });
      return { pressure, contraction: axial === "length" ? (restingLength - value) / restingLength : value, force };
    });
  }

  /* Residuals of the force of a law: number of points with a force, rms and greatest error, and mean error [N]. */
  function residualsOf(law, points) {
    const errors = points.map(({ pressure, contraction, force }) => law.force(pressure, contraction) - force).filter(Number.isFinite), n = errors.length;
    const mean = (values) => values.reduce((sum, value) => sum + value, 0) / n;
    return { count: n, rms: Math.sqrt(mean(errors.map((e) => e * e))), greatest: n ? Math.max(...errors.map(Math.abs)) : NaN, mean: mean(errors) };
  }

  Object.assign(airmuscle, { readPoints, residualsOf });
})();
