// Reads what `surflect export` writes by programs of others, and writes what they find as raw floats.
//
//   node foreign_gaussians.mjs READERS FILE OUT
//
// FILE.ply: PlayCanvas's splat-transform; FILE.usda: the parser of three.js. OUT holds the values one array after the other,
// little-endian; stdout is JSON: [[name, times or null, how many], ...], and what a file says of itself.
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [readers, file, out] = process.argv.slice(2);
const load = name => import(pathToFileURL(path.resolve(readers, name)));
const arrays = [];
let stage = null;
if (file.endsWith(".ply")) {
  execFileSync("node", [path.join(readers, "splat-transform/bin/cli.mjs"), "--quiet", "--overwrite", file, out + ".csv"]);
  const [names, ...rows] = fs.readFileSync(out + ".csv", "utf8").trim().split("\n").map(line => line.split(","));
  names.forEach((name, k) => arrays.push([name, null, rows.map(row => Number(row[k]))]));
} else {
  const { USDAParser } = await load("three/examples/jsm/loaders/usd/USDAParser.js");
  const specs = new USDAParser().parseData(fs.readFileSync(file, "utf8")).specsByPath;
  stage = { ...specs["/"].fields, prim: specs["/Surfels"].fields.typeName, schemas: specs["/Surfels.apiSchemas"].fields.default };
  for (const [name, { fields }] of Object.entries(specs)) {
    const samples = fields.timeSamples ?? { times: [null], values: [fields.default] };
    if (!/^\w+\[\]$/.test(fields.typeName ?? "")) continue;
    samples.times.forEach((time, k) => arrays.push([`${fields.typeName} ${name.split(".")[1]}`, time, samples.values[k]]));
  }
  stage.degree = specs["/Surfels.radiance:sphericalHarmonicsDegree"].fields.default;
}
fs.writeFileSync(out, Buffer.concat(arrays.map(([, , values]) => Buffer.from(Float32Array.from(values).buffer))));
console.log(JSON.stringify({ arrays: arrays.map(([name, time, values]) => [name, time, values.length]), stage }));
