/* Own points: drawn over the laws of the tab Muscle, with the residuals about each of them. */
"use strict";

(() => {
  const { element, units } = airmuscle;
  const MOST_IN_ADDRESS = 200, EXAMPLE = "pressure [bar]; contraction [%]; force [N]\n3; 10; 270\n4; 5; 700";

  class OwnPoints {
    /* changed() after other points; lengthOf() is the resting length of the active law [m] */
    constructor(host, lengthOf, changed) {
      this.points = [];
      this.changed = changed;
      const field = airmuscle.textField("Own points (CSV)", "Draw these points", async (text) => { this.take(airmuscle.readPoints(text, lengthOf())); }, { what: "CSV file", example: EXAMPLE, accept: ".csv,.tsv,.txt,text/csv,text/plain" });
      this.table = element("div.small");
      this.clear = element("button", { type: "button", hidden: true, onclick: () => this.take([]) }, "Remove the points");
      host.append(element("details", {}, element("summary", {}, "Draw own points over the law"), field), this.table, this.clear);
    }

    take(points) { this.points = points; this.changed(); }

    show(laws) {
      this.clear.hidden = !this.points.length;
      if (!this.points.length) { this.table.replaceChildren(); return; }
      const rows = laws.map((law) => { const { count, rms, greatest, mean } = airmuscle.residualsOf(law, this.points); return [law.sheet.name, String(count), ...[rms, greatest, mean].map((value) => airmuscle.shortText(value / units.force.factor, 3))]; });
      const unit = units.force.name, table = { title: "Residuals", headings: [["law"], ["points", true], [`rms error [${unit}]`, true], [`greatest [${unit}]`, true], [`mean [${unit}]`, true]].map(([text, number]) => ({ text, number })), rows };
      this.table.replaceChildren(airmuscle.chapterTable(table), element("p.soft", {}, "Force of the law less that of the points. A mean far from 0 hints at another zero, specimen or unit. For parameters with uncertainty: airmuscle fit."));
    }

    state() { return this.points.length <= MOST_IN_ADDRESS ? this.points.map(({ pressure, contraction, force }) => [pressure, contraction, force]) : []; }

    restore(rows) {
      if (!Array.isArray(rows)) return;
      const valid = rows.filter((row) => Array.isArray(row) && row.length === 3 && row.every(Number.isFinite)).slice(0, MOST_IN_ADDRESS);
      this.points = valid.map(([pressure, contraction, force]) => ({ pressure, contraction, force }));
    }
  }

  Object.assign(airmuscle, { OwnPoints });
})();
