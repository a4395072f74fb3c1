import { get, last, on, post } from "./box.js";
import { cell, h, say, show, table } from "./dom.js";
import { stepPicture } from "./step_picture.js";
import { proposal } from "./verdict.js";

const RUNNING = new Set(["waiting", "running", "solving"]);
const LABELS = { speeds_mm_s: "Speeds, mm/s", overtravel_mm: "Overtravel, mm", clearance_mm: "Clearance, mm", approach_deg: "Approach off the normal, deg", arc_deg: "Arc of C, deg", angles: "Angles", balls: "Balls or heights", tool: "Tool", axis: "Axis" };
const time = (seconds) => (seconds < 90 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`);

function significant(value) {
  if (value === null || value === undefined) return "?";
  return Number(value.toPrecision(2)).toString();
}

// Lengths are read in um, times in us.
function readable(key, value) {
  const match = /_(mm|s)(\[\d+\]|$)/.exec(key);
  if (value === null || !match) return significant(value);
  return `${significant(value * (match[1] === "mm" ? 1e3 : 1e6))} ${match[1] === "mm" ? "µm" : "µs"}`;
}

// tau_s is known as tau: the unit stands behind the value.
const named = (key) => key.replace(/_(mm|s|rad|nm|um)(?=\[|$)/, "").replaceAll("_", " ");

function forecast(plan) {
  return h("div", null, h("p", null, h("b", null, `${plan.touches} steps, about ${time(plan.duration_s)}`), plan.machine.name ? ` on ${plan.machine.name}, as this box describes it.` : " on a machine as good as usual."),
    plan.machine.why_refused ? h("p", { class: "small" }, plan.machine.why_refused) : null,
    table(["Will be known to", { text: "sd", n: true }, { text: "U (k = 2)", n: true }], Object.entries(plan.sd).slice(0, 12).map(([key, sd]) => h("tr", null, cell(named(key)), cell(readable(key, sd), true), cell(readable(key, plan.expanded_k2[key]), true))), { label: "Forecast" }));
}

export function calibrate(main) {
  let methods = [], chosen = null, plan = null, began = null, run = 0, step = 0, drawnStep = "", shownResult = 0, alive = true;
  const list = h("ul", { class: "methods", "aria-label": "Methods" });
  const detail = h("section", { class: "panel", "aria-live": "off" });
  const running = h("section", { class: "panel hidden", "aria-label": "Calibration in progress" });
  const outcome = h("section", { class: "panel hidden", "aria-live": "polite" });
  show(main, h("h2", { class: "hidden" }, "Calibrate"), running, outcome, h("div", { class: "columns" }, h("nav", { class: "panel" }, h("h3", null, "Method"), list), detail));

  const picture = h("div"), prompt = h("p", { class: "prompt", role: "status" }), left = h("p", { class: "small" }), readings = h("div");
  const meter = h("progress", { max: 1, value: 0, "aria-label": "Steps done" });
  const title = h("h3"), said = h("p", { role: "alert", class: "said" });
  const act = async (path, body) => { try { await post(path, body); say(said, ""); } catch (error) { say(said, error.message); } };
  show(running, title, h("div", { class: "columns even" }, picture, h("div", null, prompt, meter, left,
    h("div", { class: "bar" }, h("button", { onclick: () => act("mark", { phase: "begin", run, step }) }, "Step begins"), h("button", { onclick: () => act("mark", { phase: "end", run, step }) }, "Step ends"),
      h("button", { onclick: () => act("mark", { phase: "abandon", run, step }) }, "Repeat step"), h("button", { class: "danger", onclick: () => act("abort", { run }) }, "Abort")),
    h("p", { class: "small" }, "Where the controller runs the program, it says by itself when a step begins and ends."), said)), h("h4", null, "Readings"), readings);
  let taken = [];

  async function choose(method) {
    chosen = method;
    plan = null;
    for (const item of list.children) item.firstChild.setAttribute("aria-current", item.firstChild.textContent === method.title);
    const planned = h("div", null, h("p", { class: "small" }, "…"));
    const fields = Object.entries(method.options).map(([key, usual]) => {
      const input = h("input", { id: `option-${key}`, name: key, placeholder: Array.isArray(usual) ? usual.join(", ") : usual, size: 10 });
      return h("p", { class: "field" }, h("label", { for: `option-${key}` }, LABELS[key] ?? key), input);
    });
    const refusal = h("p", { role: "alert", class: "said" });
    const start = h("button", { class: "primary" }, "Start");
    const form = h("form", null, fields.length > 0 && h("details", null, h("summary", null, "Options"), fields), h("p", { class: "bar" }, start), refusal);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const body = { method: method.name };
      for (const input of form.querySelectorAll("input")) {
        const text = input.value.trim();
        if (text === "") continue;
        body[input.name] = input.name === "axis" ? text.toUpperCase() : input.name === "speeds_mm_s" ? text.split(/[\s,;]+/).map(Number) : Number(text);
      }
      start.disabled = true;
      try {
        say(refusal, "");
        await post("start", body);
        taken = [];
        shownResult = 0;
        outcome.classList.add("hidden");
      } catch (error) {
        refusal.className = "verdict failed";
        say(refusal, error.message);
      }
      start.disabled = false;
    });
    const names = (texts) => h("ul", null, texts.map((text) => h("li", null, text)));
    show(detail, h("h3", null, method.title), h("p", { class: "small" }, method.name), method.steps && h("p", null, method.steps),
      h("h4", null, "Finds"), names(method.finds.map((one) => `${one.key}: ${one.about}`)),
      method.needs.length > 0 && [h("h4", null, "Needs"), names(method.needs)],
      method.unobservable.length > 0 && [h("h4", null, "Cannot tell"), names(method.unobservable)],
      h("h4", null, "Plan"), planned, form);
    try {
      const told = await get("plan", { method: method.name });
      if (chosen !== method || !alive) return;
      plan = told;
      show(planned, forecast(told));
    } catch (error) {
      show(planned, h("p", { class: "small" }, `No forecast: ${error.message}`));
    }
  }

  function follow(p) {
    const going = RUNNING.has(p.state);
    running.classList.toggle("hidden", !going);
    if (going) {
      if (p.run !== run) { run = p.run; taken = []; began = performance.now(); }
      step = p.step;
      say(title, `${p.method}: ${p.state === "solving" ? "solving" : `step ${p.step + 1} of ${p.steps}`}`);
      say(prompt, p.prompt);
      meter.value = p.steps > 0 ? p.step / p.steps : 0;
      const passed = (performance.now() - began) * 1e-3;
      const total = p.step > 2 ? (passed / p.step) * p.steps : plan?.duration_s;
      say(left, total ? `about ${time(Math.max(0, total - passed))} left` : "");
      const key = JSON.stringify([p.step, p.run]);
      if (key !== drawnStep) { drawnStep = key; show(picture, stepPicture(p)); }
      show(readings, taken.length === 0 ? h("p", { class: "small" }, "None yet.") :
        table(["Trigger", { text: "Step", n: true }, { text: "X, mm", n: true }, { text: "Y, mm", n: true }, { text: "Z, mm", n: true }, { text: "stamp sd, ns", n: true }],
          taken.slice(-8).reverse().map((t) => h("tr", null, cell(t.number), cell(t.step + 1, true), ...t.position_mm.map((mm) => cell(mm === null ? "–" : mm.toFixed(4), true)), cell(Math.round(t.clock.sigma_ns), true))), { label: "Readings" }));
      return;
    }
    if (p.run === 0) return;
    if (p.state === "refused" || p.state === "aborted") {
      if (shownResult === -p.run) return;
      shownResult = -p.run;
      outcome.classList.remove("hidden");
      show(outcome, h("p", { class: `verdict ${p.state === "refused" ? "failed" : "neutral"}` }, p.state === "refused" ? `${p.method} was refused: ${p.refusal}` : `${p.method} was aborted.`));
    } else if (p.state === "proposed" && p.result_id > 0 && shownResult !== p.result_id) {
      shownResult = p.result_id;
      outcome.classList.remove("hidden");
      proposal(outcome, p.result_id);
    }
  }

  const offs = [
    on("state", (state) => state.procedure && follow(state.procedure)),
    on("trigger", (trigger) => {
      const p = last.state?.procedure;
      if (!p || !RUNNING.has(p.state)) return;
      taken.push({ ...trigger, step: p.step });
    }),
  ];
  get("methods").then((all) => {
    methods = all;
    show(list, methods.map((method) => h("li", null, h("button", { class: "plain", onclick: () => choose(method) }, method.title))));
    if (methods.length > 0 && chosen === null) choose(methods[0]);
  }).catch((error) => show(detail, h("p", { class: "verdict failed" }, error.message)));
  return () => { alive = false; for (const off of offs) off(); };
}
