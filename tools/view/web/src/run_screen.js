// A run as one screen: what to do now, as a picture and in words, how far it is, the readings, and stop.
import { post } from "./box.js";
import { cell, h, say, show, table } from "./dom.js";
import { stepPicture } from "./step_picture.js";
import { time } from "./time.js";

export const RUNNING = new Set(["waiting", "running", "solving"]);
const READINGS = 8; // the newest

// A sentence, in which no line begins between a sign and its axis or number.
const sentence = (text) => (text.charAt(0).toUpperCase() + text.slice(1)).replace(/(^|\s)-(?=[XYZABC\d])/g, "$1\u2212");
const sigma = (ns) => (ns < 1000 ? `${Math.round(ns)} ns` : `${(ns / 1000).toPrecision(2)} µs`);

// titleOf: of a method by its name. duration: forecast of that method in s, or undefined.
export function runScreen({ titleOf, duration }) {
  let run = 0, step = 0, first = 0, drawn = "", began = 0, taken = [];
  const picture = h("div", { class: "picture" }), prompt = h("p", { class: "prompt", role: "status" }), count = h("span", { class: "count" }), left = h("span", { class: "small" });
  const title = h("h2"), said = h("p", { role: "alert", class: "said" }), readings = h("div", { class: "full" });
  const meter = h("progress", { max: 1, value: 0, "aria-label": "Steps done" });
  const act = async (path, body) => { try { await post(path, body); say(said, ""); } catch (error) { say(said, error.message); } };
  const mark = (phase, text) => h("button", { onclick: () => act("mark", { phase, run, step }) }, text);
  const section = h("section", { class: "panel hidden", "aria-label": "Calibration in progress" },
    h("div", { class: "run" }, picture, h("div", null, title, prompt, meter, h("p", { class: "bar" }, count, left),
      h("p", { class: "bar" }, h("button", { class: "danger", onclick: () => act("abort", { run }) }, "Stop")), said,
      h("details", null, h("summary", null, "Moving by hand"), h("p", { class: "small" }, "Where the controller runs the program, it says by itself when a step begins and ends."), h("div", { class: "bar" }, mark("begin", "Step begins"), mark("end", "Step ends"), mark("abandon", "Repeat step"))))),
    h("h4", null, "Readings"), readings);

  function drawReadings() {
    show(readings, taken.length === 0 ? h("p", { class: "small" }, "None yet.") :
      table([{ text: "Step", n: true }, { text: "X, mm", n: true }, { text: "Y, mm", n: true }, { text: "Z, mm", n: true }, { text: "sd of its time", n: true }],
        taken.slice(-READINGS).reverse().map((t) => h("tr", null, cell(t.step + 1, true), ...t.position_mm.map((mm) => cell(mm === null ? "–" : mm.toFixed(4), true)), cell(sigma(t.clock.sigma_ns), true))), { label: "Readings" }));
  }

  function follow(p, going) {
    const appears = going && section.classList.contains("hidden");
    section.classList.toggle("hidden", !going);
    if (!going) return;
    if (p.run !== run) { run = p.run; first = p.step; taken = []; began = performance.now(); drawReadings(); }
    if (appears) scrollTo(0, 0);
    step = p.step;
    say(title, titleOf(p.method));
    say(prompt, p.state === "solving" ? "Computing the result." : sentence(p.prompt));
    say(count, p.state === "solving" ? `all ${p.steps} steps are done` : `step ${p.step + 1} of ${p.steps}`);
    meter.value = p.steps > 0 ? (p.state === "solving" ? 1 : p.step / p.steps) : 0;
    const passed = (performance.now() - began) * 1e-3;
    const seen = p.step - first, whole = duration(p.method); // a page may have been opened in the middle of the run
    const each = seen > 2 ? passed / seen : whole && whole / p.steps;
    say(left, each && p.state !== "solving" ? `about ${time(Math.max(0, each * (p.steps - first) - passed))} left` : "");
    const key = JSON.stringify([p.step, p.run]);
    if (key !== drawn) { drawn = key; show(picture, stepPicture(p)); }
  }

  function take(trigger, p) {
    if (!p || !RUNNING.has(p.state)) return;
    taken.push({ ...trigger, step: p.step });
    drawReadings();
  }
  return { section, follow, take };
}
