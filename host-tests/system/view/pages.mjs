// Every page at four sizes, light and dark, with 60 results and long names, in two windows at once, and without a box: as pictures
// with a contact sheet (contact-sheet.png), and their texts held against raw keys.
import { cpSync, existsSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { accessible, box, browser, CELL, check, folder, open, probebox, run, screens, start, stop, view, write } from "./common.mjs";

const top = join(dirname(fileURLToPath(import.meta.url)), "../../..");
const SIZES = { phone: [390, 844], tablet: [1024, 768], desk: [1440, 900], wall: [2560, 1440] };
const PAGES = ["machine", "live", "calibrate", "results", "tools"];
const LONG = "Bartholomaeus-Maximilian Wolfeschlegelsteinhausenbergerdorff, second shift";
const RESULTS = 60;

// A board as sim, with a machine of a long name.
function longNamed() {
  const board = join(folder, "board");
  cpSync(join(top, "board/sim"), board, { recursive: true });
  const file = join(board, "machine.toml");
  writeFileSync(file, readFileSync(file, "utf8").replace(/^name = ".*"/m, 'name = "Five-axis mill-turn centre with a swivelling head and a very long name, hall 12"'));
  return board;
}

async function say(...words) {
  const child = start(probebox, words);
  check((await child.ended) === 0, `${words.join(" ")}: ${child.text}`);
  return child.text;
}

// Results of the cases that are in the tree: many of one subject, some of others.
async function fill(uri) {
  const cases = join(top, "host-tests/unit/report/cases");
  const given = readdirSync(cases).filter((one) => existsSync(join(cases, one, "config.json")));
  const delay = given.find((one) => one === "delay-known-sphere");
  check(delay !== undefined, `no case of a delay among ${given}`);
  for (const one of given.filter((other) => other !== delay).slice(0, 8)) {
    const child = start(probebox, ["-u", uri, "propose", join(cases, one), "--as-this-machine", "--by", "Ada"]);
    await child.ended; // some of them are refused here, which is a result as well
  }
  for (let k = 0; k < RESULTS; ++k) await say("-u", uri, "propose", join(cases, delay), "--as-this-machine", "--by", "Ada");
  const all = (await say("-u", uri, "--json", "results")).split("\n").filter(Boolean).map((line) => JSON.parse(line));
  const newest = Math.max(...all.filter((one) => one.subject?.startsWith("delay")).map((one) => one.id));
  await say("-u", uri, "accept", String(newest), "--by", LONG, "--although-it-differs");
  return newest;
}

// Keys of files are told where a file is to be written; everywhere else there are names and units.
const RAW = /`|\b[a-z]\w*\[\d+\]|\b[A-Za-z]+(_\w+)*_(mm|um|nm|s|us|rad|urad|deg|hz)\b|\d (um|us|urad)\b/;
async function readable(page, where) {
  const lines = (await page.locator("body").innerText()).split("\n");
  const raw = lines.filter((line) => RAW.test(line) && !/\.toml|\[\w+\] |^\[\w+\]/.test(line));
  check(raw.length === 0, `${where} shows raw keys: ${raw.slice(0, 3).join(" | ")}`);
}

async function fits(page, where) {
  const [wide, room] = await page.evaluate(() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]);
  check(wide <= room + 1, `${where}: ${wide} px in ${room}`);
}

async function ready(page, name) {
  await page.evaluate((id) => { location.hash = id; }, name);
  await page.waitForSelector(`#tab-${name}[aria-selected=true]`);
  const shown = { machine: ".tiles .tile", live: ".positions output", calibrate: ".promise b", results: ".subject td", tools: "svg.toolpicture" }[name];
  await page.locator(shown).first().waitFor();
  if (name === "live") await page.waitForFunction(() => globalThis.probeboxLive?.slots() > 150);
  if (name === "results") {
    await page.locator("td button.plain").first().click();
    await page.waitForSelector("text=History");
  }
}

async function everyPage(chromium, address, pictures) {
  for (const [size, [width, height]] of Object.entries(SIZES)) {
    const page = await open(chromium, address, { viewport: { width, height } });
    for (const name of PAGES) {
      await ready(page, name);
      for (const scheme of ["light", "dark"]) {
        await page.emulateMedia({ colorScheme: scheme });
        const where = `${name}, ${size}, ${scheme}`;
        await fits(page, where);
        if (size === "phone" || size === "desk") await accessible(page, where);
        await page.evaluate(() => scrollTo(0, 0));
        const file = `page-${name}-${size}-${scheme}.png`;
        await page.screenshot({ path: join(screens, file) });
        pictures.push(file);
      }
      await readable(page, `${name}, ${size}`);
    }
    check(page.faults.length === 0, page.faults.join("\n"));
    await page.context().close();
  }
}

// A phone has the value on the screen; no page opens scrolled; only results about the same can be ticked.
async function onAPhone(chromium, address) {
  const page = await open(chromium, address, { viewport: { width: 390, height: 844 } });
  await ready(page, "results");
  const value = await page.locator(".subject td.value").first().boundingBox();
  check(value.x >= 0 && value.x + Math.min(value.width, 150) <= 390, `the value is at ${JSON.stringify(value)}`);
  await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
  await page.keyboard.press("Alt+1");
  await page.waitForSelector(".answer .word");
  check((await page.evaluate(() => scrollY)) === 0, "a page opens scrolled");
  await page.context().close();
}

async function comparable(chromium, address) {
  const page = await open(chromium, address);
  await ready(page, "results");
  const subjects = page.locator(".subject");
  check((await subjects.count()) > 1, "results of several subjects");
  await subjects.first().locator("input[type=checkbox]").first().check();
  const other = page.locator(".subject").nth(1).locator("input[type=checkbox]").first();
  check(await other.isDisabled(), "unlike results can be compared");
  await page.context().close();
}

// Two windows say the same, and both know when the box is gone.
async function twoWindows(chromium, address, daemon, pictures) {
  const pages = [await open(chromium, address), await open(chromium, address)];
  const words = await Promise.all(pages.map((page) => page.locator(".answer .word").innerText()));
  check(words[0] === words[1] && words[0] === "Check", `two windows: ${words}`);
  check((await pages[0].locator(".answer .reason").innerText()).length > 20, "the one reason is missing");
  await stop(daemon);
  for (const page of pages) {
    await page.waitForSelector(".answer.unknown");
    await page.waitForSelector("#link.failed");
  }
  await pages[0].screenshot({ path: join(screens, "page-machine-lost-link.png") });
  pictures.push("page-machine-lost-link.png");
  for (const page of pages) check(page.faults.length === 0, page.faults.join("\n"));
}

// All pictures beside each other, for a person.
async function contactSheet(chromium, pictures) {
  const figures = pictures.map((file) => `<figure><img src="data:image/png;base64,${readFileSync(join(screens, file)).toString("base64")}"><figcaption>${file}</figcaption></figure>`);
  const html = `<!doctype html><title>Contact sheet</title><style>body{margin:12px;font:13px sans-serif;display:flex;flex-wrap:wrap;gap:12px;background:#888}figure{margin:0;background:#fff;padding:4px}img{height:300px;display:block}</style>${figures.join("")}`;
  writeFileSync(join(screens, "contact-sheet.html"), html);
  const page = await (await chromium.newContext({ viewport: { width: 2400, height: 1200 } })).newPage();
  await page.setContent(html);
  await page.screenshot({ path: join(screens, "contact-sheet.png"), fullPage: true });
}

run(async () => {
  const chromium = await browser();
  try {
    const daemon = await box("long", 0, longNamed());
    await fill(daemon.uri);
    const server = await view(daemon.uri, "--cell", write("cell.toml", CELL));
    const pictures = [];
    await everyPage(chromium, server.address, pictures);
    await onAPhone(chromium, server.address);
    await comparable(chromium, server.address);
    await twoWindows(chromium, server.address, daemon, pictures);
    await contactSheet(chromium, pictures);
  } finally {
    await chromium.close();
  }
});
