const list = (names) => names.join(", ") || "none";

function checkKeys(what, given, known) {
  for (const key of Object.keys(given))
    if (!known.includes(key)) throw new RangeError(`${what}: there is no '${key}'; there are ${list(known)}.`);
}

function checkRow(what, row, names) {
  if (row?.length !== names.length)
    throw new RangeError(`${what}: ${row?.length ?? "no"} values are given; give ${names.length}: ${list(names)}.`);
  for (let i = 0; i < names.length; i++)
    if (!Number.isFinite(row[i])) throw new RangeError(`${what}: ${names[i]} is ${row[i]}; it must be a finite number.`);
}

/** Throws RangeError for a parameter beyond its bounds. */
function checkBounds(what, row, names, lowest, highest) {
  const wrong = names.findIndex((name, i) => !(row[i] >= lowest[i] && row[i] <= highest[i]));
  if (wrong >= 0)
    throw new RangeError(`${what}: ${names[wrong]} is ${row[wrong]}; allowed are ${lowest[wrong]} to ${highest[wrong]}.`);
}

/** All values in their order, or some by name; the others are those of `usual`. */
function valuesOf(what, given, names, usual) {
  let row = given;
  if (given === null || typeof given !== "object") throw new RangeError(`${what}: give an array, or values by name.`);
  if (!Array.isArray(given) && !ArrayBuffer.isView(given)) {
    checkKeys(what, given, names);
    row = names.map((name, i) => given[name] ?? usual[i]);
  }
  checkRow(what, row, names);
  return row;
}

function checkSegments(what, {ends, values, slopes} = {}, names) {
  if (!ends?.length || values?.length !== ends.length || slopes?.length !== ends.length)
    throw new RangeError(`${what}: ends, values and slopes must have one element for each segment.`);
  values.forEach((row) => checkRow(`${what}, values`, row, names));
  slopes.forEach((row) => checkRow(`${what}, slopes`, row, names));
}
