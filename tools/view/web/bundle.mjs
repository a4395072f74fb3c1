// Bundles the page: `node bundle.mjs FOLDER` writes index.html, app.js and app.css there. Nothing is fetched at run time.
import { build } from "esbuild";
import { copyFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const folder = process.argv[2];
await build({
  entryPoints: [join(here, "src/app.js"), join(here, "src/app.css")],
  outdir: folder,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "eof",
  logLevel: "warning",
});
await copyFile(join(here, "src/index.html"), join(folder, "index.html"));
