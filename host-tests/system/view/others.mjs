// A replayed recording, a link that is lost and comes back, and a page that stays open.
import { box, browser, check, folder, open, picture, probebox, run, start, stop, view } from "./common.mjs";
import { join } from "node:path";

async function replay(chromium, uri) {
  const path = join(folder, "scan.pbx");
  const recording = start(probebox, ["-u", uri, "record", "-o", path, "--for", "4"]);
  check((await recording.ended) === 0, recording.text);
  const server = await view(`file:${path}`);
  const page = await open(chromium, server.address);
  await page.waitForSelector(".answer.unknown"); // a recording has no machine
  await page.keyboard.press("Alt+2");
  await page.waitForFunction(() => globalThis.probeboxLive?.slots() > 100);
  await page.keyboard.press("Alt+3");
  await page.locator(".methods button").first().click();
  await page.getByRole("button", { name: "Start" }).click();
  await page.locator("form .verdict.failed").waitFor();
  await picture(page, "replay-refuses");
  check((await stop(server)) === 130, server.text);
  await page.waitForSelector("text=probebox view has ended");
  await page.context().close();
}

// Memory of a page that has seen many more samples than it keeps: an hour's slots at once, a minute's are kept.
async function memory(page) {
  await page.goto(`${page.url().split("#")[0]}#live`);
  await page.reload();
  await page.waitForFunction(() => globalThis.probeboxLive?.slots() > 100);
  check((await page.evaluate(() => globalThis.probeboxLive.slots())) <= 6100, "more slots than a minute");
}

// An answer about the machine does not stay on the page when the server that gave it is gone.
async function endedServer(chromium, uri) {
  const server = await view(uri);
  const page = await open(chromium, server.address);
  await page.waitForSelector(".answer:is(.yes, .check, .stop)");
  check((await stop(server)) === 130, server.text);
  await page.waitForSelector(".answer.unknown >> text=Not known");
  await page.keyboard.press("Alt+2");
  await page.keyboard.press("Alt+1");
  await page.waitForSelector(".answer.unknown >> text=Not known"); // nor when one comes back to it
  await page.context().close();
}

async function lostLink(chromium) {
  const daemon = await box("lost");
  const port = daemon.uri.split(":").at(-1);
  const server = await view(daemon.uri);
  const page = await open(chromium, server.address);
  await page.waitForFunction(() => /locked/.test(document.getElementById("link").textContent));
  await memory(page);
  await stop(daemon, "SIGKILL");
  await page.waitForSelector("#link.failed");
  check(/link lost/.test(await page.textContent("#link")), await page.textContent("#link"));
  await page.waitForSelector("main.stale >> text=these are the last values");
  await picture(page, "link-lost-live");
  await page.keyboard.press("Alt+1");
  await page.waitForSelector(".answer.unknown");
  await page.keyboard.press("Alt+5");
  await page.waitForSelector("main:not(.stale) .verdict.failed >> text=the link to the box is down");
  await page.keyboard.press("Alt+4");
  await page.waitForSelector("text=the link to the box is down");
  await picture(page, "link-lost");
  await box("lost", port);
  await page.waitForFunction(() => /locked/.test(document.getElementById("link").textContent) && document.getElementById("link").className === "pass");
  await page.waitForSelector("text=None yet: calibrate"); // without a hand that asks again
  check(page.faults.length === 0, page.faults.join("\n"));
}

run(async () => {
  const chromium = await browser();
  try {
    const daemon = await box();
    await replay(chromium, daemon.uri);
    await endedServer(chromium, daemon.uri);
    await lostLink(chromium);
  } finally {
    await chromium.close();
  }
});
