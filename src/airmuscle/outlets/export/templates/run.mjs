@provenance@
/* Run of the scenario; writes CSV to the standard output: node @file@.run.mjs > run.csv */
import {simulate} from "./@file@.mjs";

const selected = @columns@;
const header = @header@;
const {columns, status, steps, rejected, time} = simulate();
const rows = columns.time.map((_, row) => selected.map((name) => columns[name][row]).join(","));
process.stdout.write(header + rows.map((row) => `${row}\n`).join(""));
process.stderr.write(`${steps} steps, ${rejected} rejected, time ${time} s\n`);
process.exitCode = status;
