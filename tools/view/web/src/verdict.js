// A result: the decision about it, beside the one in force, and how it comes into force.
import { get, post } from "./box.js";
import { cell, h, show, table, valueCell } from "./dom.js";
import { keeping, state } from "./icons.js";
import { trendFigure } from "./trend.js";

export const name = () => localStorage.getItem("name") ?? "";

// The first line of everything about a result.
export function decision(result) {
  if (result.refusal) return h("p", { class: "decision stop" }, state("stop", "Refused"), h("span", { class: "value" }, result.refusal.reason));
  const decisive = result.decisive;
  if (!decisive) return null;
  const [kind, word] = keeping(decisive);
  const warned = kind !== "stop" && (result.warnings ?? []).length > 0;
  return h("div", { class: `decision ${warned ? "check" : kind}` }, state(warned ? "check" : kind, warned ? "With a warning" : word), h("span", { class: "value" }, decisive.text),
    h("span", { class: "small" }, decisive.limit === null ? "A limit is stated in machine.toml: [[requirement]] with this subject." : decisive.ratio === null ? `${decisive.limit_text}; U is not known` : `${decisive.limit_text}; ${Math.round(100 * decisive.ratio)} % of it with U`));
}

export function quantities(result) {
  return table(["Quantity", { text: "Value, sd, U (k = 2)", n: true }], result.quantities.map((one) => h("tr", null, cell(one.name), cell(one.text, true))), { label: "Values", class: "stack" });
}

export function beside(comparison) {
  const first = comparison.rows.every((row) => row.before === null);
  if (first) return h("div", null, h("p", null, "The first result about ", h("b", null, comparison.title), ": none is in force to compare with."),
    table(["Quantity", { text: "Value", n: true }], comparison.rows.map((row) => h("tr", null, cell(row.name), cell(row.now, true))), { label: "Values", class: "stack" }));
  const far = comparison.rows.filter((row) => row.in_sd !== null).sort((a, b) => b.in_sd - a.in_sd);
  const rows = far.length > 24 ? far.slice(0, 24) : comparison.rows;
  return h("div", null, rows.length < comparison.rows.length && h("p", { class: "small" }, `The ${rows.length} of ${comparison.rows.length} values that differ most.`),
    table(["Quantity", { text: "After (this one)", n: true }, { text: "Before (in force)", n: true }, { text: "Difference", n: true }, { text: "in sd", n: true }],
      rows.map((row) => h("tr", { class: row.in_sd > 4 ? "far" : null }, cell(row.name), valueCell(row.now), valueCell(row.before ?? "none"), cell(row.difference ?? "", true), cell(row.in_sd === null ? "" : row.in_sd.toFixed(1), true))), { label: "Comparison" }));
}

// The form by which a person accepts. after: called once it is accepted.
export function acceptance(id, after) {
  const by = h("input", { id: `by-${id}`, autocomplete: "name", required: true, value: name(), maxlength: 80 });
  const said = h("p", { role: "alert", class: "said" });
  const although = h("label", { class: "hidden" }, h("input", { type: "checkbox" }), " put it into force although it differs");
  const button = h("button", { class: "primary" }, "Accept");
  const form = h("form", { class: "bar" }, h("label", { for: `by-${id}` }, "Accepted by"), by, although, button, said);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    localStorage.setItem("name", by.value);
    button.disabled = true;
    try {
      const answer = await post("accept", { id, by: by.value, although_it_differs: although.firstChild.checked });
      show(form, h("p", { class: "verdict pass", role: "status" }, answer.waiting_for_cut ? `Result ${id} is accepted and comes into force at the end of the cut.` : `Result ${id} is in force.`, (answer.notes ?? []).map((note) => h("p", null, note))));
      after?.();
    } catch (error) {
      said.textContent = error.message;
      if (error.name === "differs") although.classList.remove("hidden");
      button.disabled = false;
    }
  });
  return form;
}

// The end of a run: decision, what it changes, and the form to accept it.
export async function proposal(holder, id, after) {
  show(holder, h("p", null, "…"));
  try {
    const [result, comparison] = await Promise.all([get("result", { id }), get("comparison", { id })]);
    show(holder, h("div", { class: "bar" }, h("h3", null, `${result.title}: result ${id}`), h("span", { class: "small" }, result.standing)), decision(result),
      (result.warnings ?? []).map((warning) => h("p", { class: "verdict warned" }, warning)),
      result.state === "proposed" && acceptance(id, after),
      comparison ? beside(comparison) : result.quantities && quantities(result),
      (result.trend?.points.length ?? 0) > 1 && trendFigure(result.trend, { chosen: id }),
      h("p", null, h("a", { href: `#results/${id}` }, "Everything about it")));
  } catch (error) {
    show(holder, h("p", { class: "verdict failed" }, error.message));
  }
}
