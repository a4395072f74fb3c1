// An emulated box, `probebox view` on it, and a browser.
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

export const [, , probeboxd, probebox, web, screens] = process.argv;
export const PATIENCE = 240_000;
const require = createRequire(join(web, "package.json"));
const children = [];
export const folder = mkdtempSync(join(tmpdir(), "probebox-view-"));
mkdirSync(screens, { recursive: true });

export function check(holds, what) {
  if (!holds) throw new Error(what);
}

export async function until(what, holds) {
  for (const end = Date.now() + PATIENCE; Date.now() < end; await new Promise((r) => setTimeout(r, 50))) {
    const answer = await holds();
    if (answer) return answer;
  }
  throw new Error(`not in time: ${what}`);
}

export function start(command, words, environment = {}) {
  const child = spawn(command, words, { env: { ...process.env, ...environment }, stdio: ["ignore", "pipe", "pipe"] });
  child.text = "";
  child.stdout.on("data", (data) => { child.text += data; });
  child.stderr.on("data", (data) => { child.text += data; });
  child.ended = new Promise((done) => { child.on("exit", (status) => { child.status = status; done(status); }); });
  children.push(child);
  return child;
}

export async function stop(child, signal = "SIGINT") {
  if (child.status === undefined && child.exitCode === null) child.kill(signal);
  return child.ended;
}

export async function box(name = "box", port = 0, board = "sim") {
  const home = join(folder, name);
  mkdirSync(home, { recursive: true });
  const daemon = start(probeboxd, ["--board", board, "--state", join(home, "state"), "--link", `tcp:127.0.0.1:${port}`], { PROBEBOX_RENDEZVOUS: home });
  const path = join(home, `${daemon.pid}.uri`);
  daemon.uri = await until("the box listens", () => existsSync(path) && /tcp:\S+/.exec(readFileSync(path, "utf8"))?.[0]);
  return daemon;
}

export async function view(uri, ...more) {
  const server = start(probebox, ["--json", "-u", uri, "view", ...more]);
  const line = await until("the page is served", () => {
    if (server.status !== undefined) throw new Error(server.text);
    return /\{.*"address".*\}/.exec(server.text)?.[0];
  });
  server.address = JSON.parse(line).address;
  return server;
}

// drawing: a computer without a graphics card has three dimensions only by an emulation, which makes all else slow.
export async function browser(drawing = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]) {
  const path = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find((one) => existsSync(one));
  if (path === undefined) {
    console.log("Skipped: chromium is not installed (apt-get install chromium)");
    process.exit(77);
  }
  const { chromium } = require("playwright-core");
  return chromium.launch({ executablePath: path, args: ["--no-sandbox", "--disable-dev-shm-usage", ...drawing] });
}

// A page of its own; whatever goes wrong in it ends the test, and so does a request to anywhere else. before: runs in it first.
export async function open(chromium, address, options = {}, before = undefined) {
  const context = await chromium.newContext({ viewport: { width: 1280, height: 900 }, ...options });
  const page = await context.newPage();
  if (before !== undefined) await page.addInitScript(before);
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(String(error)));
  page.on("console", (message) => { if (message.type() === "error" && !/Failed to load resource/.test(message.text())) page.faults.push(message.text()); });
  page.on("request", (request) => { if (!/^(http:\/\/127\.0\.0\.1:|data:|blob:)/.test(request.url())) page.faults.push(`asks ${request.url()}`); });
  page.setDefaultTimeout(PATIENCE);
  await page.goto(address);
  return page;
}

export async function picture(page, name) {
  await page.evaluate(() => scrollTo(0, 0)); // the head of the page would stand in the middle of it
  return page.screenshot({ path: join(screens, `${name}.png`), fullPage: true });
}

// axe-core runs in the page by the debugger's connection: its own policy lets no other script in.
export async function accessible(page, where) {
  await page.evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8"));
  const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"] }));
  check(found.violations.length === 0, `${where}: ${JSON.stringify(found.violations.map((one) => [one.id, one.nodes.slice(0, 3).map((node) => [node.html.slice(0, 160), node.failureSummary])]), null, 1)}`);
}

export async function run(test) {
  let status = 1;
  try {
    await test();
    status = 0;
  } catch (error) {
    console.log(error.stack ?? error);
  } finally {
    for (const child of children) await stop(child, "SIGTERM");
    rmSync(folder, { recursive: true, force: true });
  }
  process.exit(status);
}
export const write = (name, text) => { const path = join(folder, name); writeFileSync(path, text); return path; };

// A table that turns, a vise jaw and a block on it, and one tool.
export const CELL = `
[cell]
name = "test cell"
program_zero_mm = [120, 80, -100]
[[rotary_axis]]
letter = "C"
carries = "solids"
through_mm = [120, 80, -200]
[[solid]]
name = "table"
part = "machine"
shape = "box"
size_mm = [400, 300, 40]
at_mm = [120, 80, -220]
[[solid]]
name = "vise jaw"
part = "fixture"
shape = "box"
size_mm = [20, 120, 60]
at_mm = [60, 80, -170]
moves_with = "C"
[[solid]]
name = "block"
part = "workpiece"
shape = "box"
size_mm = [80, 60, 50]
at_mm = [120, 80, -175]
moves_with = "C"
[[tool]]
number = 4
holder_radius_mm = 20
holder_length_mm = 70
radius_mm = 6
length_mm = 60
cutting_mm = 30
assembled_length_mm = 58.2503
W1_mm = [-0.012, 0.008]
`;
