// A whole calibration by page alone, and every screen as a picture, light and dark, wide and on a phone.
import { accessible, box, browser, CELL, check, open, picture, probebox, run, start, view, write } from "./common.mjs";

const HOSTILE = `<img src=x onerror="document.title='owned'"> Ada`;

async function screens(page, name, where) {
  for (const scheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme: scheme });
    await accessible(page, `${where}, ${scheme}`);
    await picture(page, `${name}-${scheme}`);
  }
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 390, height: 844 });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= 391, `${where}: ${wide} px wide on a phone`);
  await picture(page, `${name}-phone`);
  await page.setViewportSize({ width: 1280, height: 900 });
}

// Nothing is calibrated yet: that is the one reason.
async function machineTab(page) {
  await page.waitForSelector("#tab-machine[aria-selected=true]");
  await page.waitForSelector(".answer.check");
  check(/calibrated/.test(await page.locator(".answer .reason").innerText()), "the reason");
  await screens(page, "machine-first", "Machine, nothing measured");
}

// The delay is in force, and within what machine.toml requires.
async function machineAfter(page) {
  await page.keyboard.press("Alt+1");
  const tile = page.locator(".tile", { has: page.locator("h3", { hasText: /^Delay$/ }) });
  await tile.waitFor();
  check(/Within limit/.test(await tile.innerText()) && /due in/.test(await tile.innerText()), await tile.innerText());
  check((await page.locator("[aria-label='In force']").last().innerText()).includes("Ada"), "by whom it is in force");
  await screens(page, "machine", "Machine");
}

async function liveTab(page) {
  await page.keyboard.press("Alt+2");
  await page.waitForSelector("#tab-live[aria-selected=true]");
  await page.waitForFunction(() => globalThis.probeboxLive?.slots() > 300 && /locked/.test(document.getElementById("link").textContent));
  const position = await page.locator(".positions output").first().textContent();
  check(/^-?\d+\.\d{3,4}$/.test(position), `a position: ${position}`);
  await page.waitForSelector('.tile:has-text("Angles") >> text=/^C.-?[0-9]+\\.[0-9]{4}/');
  const frames = await page.evaluate(() => new Promise((done) => { let n = 0; const begin = performance.now(); const one = () => { n += 1; if (performance.now() - begin < 3000) requestAnimationFrame(one); else done(n / 3); }; requestAnimationFrame(one); }));
  console.log(`${frames.toFixed(0)} frames a second`);
  await page.keyboard.press("Space");
  const held = await page.evaluate(() => document.querySelector(".chart canvas").toDataURL());
  await page.waitForTimeout(600);
  check(held === (await page.evaluate(() => document.querySelector(".chart canvas").toDataURL())), "a paused chart moves");
  await page.keyboard.press("Space");
  await page.waitForFunction((before) => document.querySelector(".chart canvas").toDataURL() !== before, held);
  await screens(page, "live", "Live");
}

async function calibrateTab(page) {
  await page.keyboard.press("Alt+3");
  await page.locator(".methods button", { hasText: "several speeds" }).click();
  await page.waitForSelector(".promise b");
  await screens(page, "calibrate", "Calibrate");

  // Refused, with its remedy: a centreline needs a delay in force.
  await page.locator(".methods button", { hasText: /turning axis|centreline/i }).first().click();
  await page.getByRole("button", { name: "Start" }).click();
  const refusal = page.locator("form .verdict.failed");
  await refusal.waitFor();
  check((await refusal.textContent()).length > 20, "a refusal names the remedy");
  await picture(page, "calibrate-refused");

  await page.locator(".methods button", { hasText: "several speeds" }).click();
  await page.locator("summary", { hasText: "Options" }).click();
  await page.evaluate(() => scrollTo(0, document.body.scrollHeight));
  await page.getByLabel("Speeds, mm/s").fill("5, 6, 7, 8, 9, 10, 12, 15");  // long enough for a busy computer
  await page.getByRole("button", { name: "Start" }).click();
  await page.waitForSelector("svg.step");
  const prompt = await page.locator(".run .prompt").boundingBox();
  check(prompt.y > 0 && prompt.y + prompt.height < 900, `the run is off the screen: ${JSON.stringify(prompt)}`);
  await page.waitForSelector("section[aria-label='Calibration in progress'] td");
  await page.keyboard.press("Alt+2");
  await page.waitForSelector("section[aria-label='Newest touch'] dl");
  check(/mm\/s/.test(await page.locator("section[aria-label='Newest touch']").innerText()), "the touch has the speed of its way in");
  await page.keyboard.press("f");
  await page.waitForFunction(() => globalThis.probeboxLive?.isFrozen());
  await picture(page, "live-frozen");
  await page.keyboard.press("Alt+3");
  await page.waitForSelector("svg.step");
  await screens(page, "calibrate-running", "Calibrate, running");
  await page.waitForSelector("text=The first result about");
  await screens(page, "calibrate-proposed", "Calibrate, proposed");
  const bell = await page.evaluate(() => fetch("/api/accept", { method: "POST", body: JSON.stringify({ id: 1, by: "Ada\u0007\u001b[31m" }) }).then(async (one) => [one.status, await one.text()]));
  check(bell[0] === 409 && /control character/.test(bell[1]), `a name with control characters: ${bell}`);
  await page.getByLabel("Accepted by").fill(HOSTILE);
  await page.getByRole("button", { name: "Accept" }).click();
  await page.waitForSelector(".verdict.pass");
  check(/in force/.test(await page.locator(".verdict.pass").textContent()), "it is in force");
  check((await page.locator(".decision .value").textContent()).includes("\u00b5s"), "the decision has the value");
  await picture(page, "calibrate-accepted");
}

async function resultsTab(page) {
  await page.keyboard.press("Alt+4");
  await page.locator("td button.plain").first().click();
  await page.waitForSelector("text=History");
  check((await page.textContent("main")).includes(HOSTILE), "the name of a person is shown as it is");
  check((await page.title()) !== "owned" && (await page.locator("main img").count()) === 0, "a name became markup");
  await page.getByRole("button", { name: "Report in place" }).click();
  const frame = page.frameLocator("iframe");
  await frame.locator("h1").waitFor();
  await screens(page, "results", "Results");
}

async function toolsTab(page) {
  await page.keyboard.press("Alt+5");
  await page.waitForSelector(".scene canvas");
  await page.waitForFunction(() => /mm|touch/.test(document.querySelector(".verdict[role=status]")?.textContent ?? ""));
  const drawn = await page.textContent("svg.toolpicture");
  check(/L1 62\.0000/.test(drawn) && /store 58\.0000/.test(drawn) && /L3 58\.2503/.test(drawn), `lengths in store are the box's: ${drawn}`);
  await screens(page, "tools", "Tools");
  await page.getByLabel("Check a program").fill("G21 G90\nG0 X-60 Y0 Z60\nG0 X-60 Y0 Z-40\n");
  await page.getByRole("button", { name: "Check" }).click();
  await page.waitForSelector("text=1 hit in 1 move");
  check(/vise jaw/.test(await page.textContent("main")), "the solid that was hit is named");
  await picture(page, "tools-hit");
  await page.getByLabel("Check a program").fill("G21 G90\nG0 X-60 Y0 Z60\nG0 X0 Y0 Z10\nG1 Z-60 F200\nG1 X20\nG0 Z60\n");
  await page.getByRole("button", { name: "Check" }).click();
  await page.waitForSelector("text=/No hit in 4 moves.* [1-9][0-9]* mm³ are cut/");
  await picture(page, "tools-program");
  // The table turns the jaw against a tool that stands still.
  await page.getByLabel("Check a program").fill("G21 G90\nG0 X0 Y-60 Z-45\nG0 C90\n");
  await page.getByRole("button", { name: "Check" }).click();
  await page.waitForSelector("text=1 hit in 1 move");
  await page.waitForSelector("text=Line 3: cutter and vise jaw: they touch");
  await picture(page, "tools-turned");
  await page.getByRole("button", { name: "Where the machine stands" }).click();
  await page.waitForSelector("text=/stands now \\(C .*: cutter and block: /");
}

// A second result: beside the one in force, in the trend, and compared.
async function twoResults(page, uri) {
  const again = start(probebox, ["-u", uri, "calibrate", "delay-multi-speed", "--speed", "20,30,40"]);
  check((await again.ended) === 0, again.text);
  await page.keyboard.press("Alt+4");
  await page.locator("td button.plain", { hasText: /^2$/ }).click();
  await page.waitForSelector("text=Beside the one in force");
  const differences = await page.locator("[aria-label=Comparison] tbody td:nth-child(4)").allTextContents();
  // Two digits of the sd: what is far from zero has more, as far as its last place counts.
  check(differences.length > 5 && differences.every((one) => /^[+-]?\d{1,4}(\.\d{1,7})?( \u00b5s)?$/.test(one)), `differences: ${differences}`);
  check((await page.locator("svg.trend .point").count()) === 2 && (await page.locator("svg.trend").first().innerHTML()).includes("\u00b5s"), "the trend has its values and their unit");
  await screens(page, "results-beside", "Results, beside the one in force");
  for (const id of [2, 1]) await page.getByLabel(`compare result ${id}`).check();
  const table = page.locator("[aria-label='Two results']");
  await table.waitFor();
  check(await table.evaluate((one) => one.scrollWidth <= one.clientWidth + 1), "two results do not fit beside each other");
  await screens(page, "results-compared", "Results, compared");
}

run(async () => {
  const chromium = await browser();
  try {
    const daemon = await box();
    const server = await view(daemon.uri, "--cell", write("cell.toml", CELL));
    const page = await open(chromium, server.address);
    await machineTab(page);
    await liveTab(page);
    await calibrateTab(page);
    await machineAfter(page);
    await resultsTab(page);
    await toolsTab(page);
    await twoResults(page, daemon.uri);
    check(page.faults.length === 0, page.faults.join("\n"));
  } finally {
    await chromium.close();
  }
});

