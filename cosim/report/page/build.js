// Makes bundle/replay.js and bundle/replay.css from src/, and bundle/tables.js for pages without a
// replay. The script of the replay begins with the hash of the sources and with the licences of
// what it contains.
import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { build } from "esbuild";

const hash = createHash("sha256");
for (const name of [
  "package.json",
  ...readdirSync("src")
    .sort()
    .map((file) => `src/${file}`),
])
  hash.update(readFileSync(name));
const licences = ["three", "uplot"].map(
  (name) => `${name}\n\n${readFileSync(`node_modules/${name}/LICENSE`, "utf8").trim()}`,
);
await build({
  entryPoints: ["src/tables.js"],
  outfile: "bundle/tables.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
});
await build({
  entryPoints: ["src/main.js"],
  outfile: "bundle/replay.js",
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "inline",
  banner: { js: `/* made from sources ${hash.digest("hex")}\n\n${licences.join("\n\n")}\n*/` },
});
