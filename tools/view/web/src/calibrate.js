// Methods by what one wants to know, each with its forecast; while a run is on, the run alone (run_screen.js).
import { get, last, on, post } from "./box.js";
import { cell, h, say, show, table } from "./dom.js";
import { runScreen, RUNNING } from "./run_screen.js";
import { time } from "./time.js";
import { proposal } from "./verdict.js";

const GROUPS = [["delay", "Delay between probe and machine"], ["axis", "Axes of spindle and part"], ["tool", "Tools and tool setter"], ["head", "Swivelling head"], ["table", "Rotary table"], ["screw", "Ball screws"], ["machine", "The machine as a whole"]];
const LABELS = { speeds_mm_s: "Speeds, mm/s", overtravel_mm: "Overtravel, mm", clearance_mm: "Clearance, mm", approach_deg: "Approach off the normal, deg", arc_deg: "Arc of C, deg", angles: "Angles", balls: "Balls or heights", tool: "Tool", axis: "Axis" };
const CHECK = "periodic-check";

function forecast(plan) {
  const best = plan.quantities.find((one) => one.expanded_k2 !== null);
  return h("div", null,
    h("div", { class: "promise" }, h("div", null, h("span", null, "takes about"), h("b", null, time(plan.duration_s))), h("div", null, h("span", null, "steps"), h("b", null, plan.touches)),
      best && h("div", null, h("span", null, `${best.name} known to U (k = 2)`), h("b", null, `± ${best.expanded_k2}`))),
    h("p", { class: "small" }, plan.machine.name ? `On ${plan.machine.name}, as this box describes it.` : "On a machine as good as usual."),
    plan.machine.why_refused ? h("p", { class: "verdict warned" }, plan.machine.why_refused) : null,
    plan.quantities.length > 1 && h("details", null, h("summary", null, "Forecast of each value"), table(["Value", { text: "sd", n: true }, { text: "U (k = 2)", n: true }], plan.quantities.slice(0, 24).map((one) => h("tr", null, cell(one.name), cell(one.sd ?? "?", true), cell(one.expanded_k2 ?? "?", true))), { label: "Forecast" })));
}

// What the fields of a form ask for; empty ones leave it to the method.
function asked(form, method) {
  const body = { method: method.name };
  for (const input of form.querySelectorAll("input")) {
    const text = input.value.trim();
    if (text === "") continue;
    body[input.name] = input.name === "axis" ? text.toUpperCase() : input.name === "speeds_mm_s" ? text.split(/[\s,;]+/).map(Number) : Number(text);
  }
  return body;
}

export function calibrate(main) {
  let methods = [], chosen = null, plan = null, shown = 0, alive = true;
  const list = h("div"), detail = h("section", { class: "panel", "aria-live": "off" });
  const outcome = h("section", { class: "panel hidden", "aria-live": "polite", "aria-label": "Outcome" });
  const choice = h("div", { class: "columns" }, h("nav", { class: "panel", "aria-label": "Methods" }, list), detail);
  const running = runScreen({ titleOf: (name) => methods.find((one) => one.name === name)?.title ?? name, duration: (name) => (plan?.method === name ? plan.duration_s : undefined) });
  show(main, h("h2", { class: "hidden" }, "Calibrate"), running.section, outcome, choice);

  async function begin(body, refusal, button) {
    button.disabled = true;
    try {
      say(refusal, "");
      await post("start", body);
      shown = 0;
      outcome.classList.add("hidden");
      scrollTo(0, 0); // the run is at the top
    } catch (error) {
      refusal.className = "verdict failed";
      say(refusal, error.message);
    }
    button.disabled = false;
  }

  function startForm(method) {
    const fields = Object.entries(method.options).map(([key, usual]) => {
      const input = h("input", { id: `option-${key}`, name: key, placeholder: Array.isArray(usual) ? usual.join(", ") : usual, size: 10 });
      return h("p", { class: "field" }, h("label", { for: `option-${key}` }, LABELS[key] ?? key), input);
    });
    const refusal = h("p", { role: "alert", class: "said" }), start = h("button", { class: "primary" }, "Start");
    const form = h("form", null, h("p", { class: "bar" }, start), refusal, fields.length > 0 && h("details", null, h("summary", null, "Options"), fields));
    form.addEventListener("submit", (event) => { event.preventDefault(); begin(asked(form, method), refusal, start); });
    return form;
  }

  async function choose(method) {
    chosen = method;
    plan = null;
    for (const button of list.querySelectorAll(".methods button")) button.setAttribute("aria-current", button.textContent === method.title);
    const planned = h("div", null, h("p", { class: "small" }, "Forecasting…"));
    const names = (texts) => h("ul", null, texts.map((text) => h("li", null, text)));
    show(detail, h("h2", null, method.title), method.steps && h("p", { class: "small" }, method.steps), planned, startForm(method),
      h("h4", null, "What it gives"), names(method.finds.map((one) => [h("b", null, one.name), one.about && `: ${one.about}`])),
      method.needs.length > 0 && [h("h4", null, "What it needs"), names(method.needs)],
      method.unobservable.length > 0 && [h("h4", null, "What it cannot tell"), names(method.unobservable)]);
    try {
      const told = await get("plan", { method: method.name });
      if (chosen !== method || !alive) return;
      plan = told;
      show(planned, forecast(told));
    } catch (error) {
      if (chosen === method) show(planned, h("p", { class: "small" }, `No forecast: ${error.message}`));
    }
  }

  function drawList() {
    const refusal = h("p", { role: "alert", class: "said" }), check = methods.some((one) => one.name === CHECK);
    const verify = check && h("button", { class: "primary", onclick: (event) => begin({ method: CHECK }, refusal, event.target) }, "Verify now");
    show(list, verify && h("div", null, verify, h("p", { class: "small" }, "Runs the periodic check with its usual options."), refusal),
      GROUPS.map(([group, title]) => {
        const some = methods.filter((one) => one.group === group);
        return some.length > 0 && [h("h3", { class: "group" }, title), h("ul", { class: "methods" }, some.map((one) => h("li", null, h("button", { class: "plain", onclick: () => choose(one) }, one.title))))];
      }));
  }

  function follow(p) {
    const going = RUNNING.has(p.state);
    choice.classList.toggle("hidden", going);
    running.follow(p, going);
    if (going || p.run === 0) return;
    if (p.state === "refused" || p.state === "aborted") {
      if (shown === -p.run) return;
      shown = -p.run;
      outcome.classList.remove("hidden");
      const title = methods.find((one) => one.name === p.method)?.title ?? p.method;
      show(outcome, h("p", { class: `verdict ${p.state === "refused" ? "failed" : "neutral"}` }, p.state === "refused" ? `${title} was refused: ${p.refusal}` : `${title} was stopped. Nothing has changed.`));
    } else if (p.state === "proposed" && p.result_id > 0 && shown !== p.result_id) {
      shown = p.result_id;
      outcome.classList.remove("hidden");
      proposal(outcome, p.result_id);
    }
  }

  const offs = [on("state", (state) => state.procedure && follow(state.procedure)), on("trigger", (trigger) => running.take(trigger, last.state?.procedure))];
  get("methods").then((all) => {
    methods = all;
    drawList();
    if (methods.length > 0 && chosen === null) choose(methods.find((one) => one.group === GROUPS[0][0]) ?? methods[0]);
  }).catch((error) => show(detail, h("p", { class: "verdict failed" }, error.message)));
  return () => { alive = false; for (const off of offs) off(); };
}
