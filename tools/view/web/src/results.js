import { get, on, post } from "./box.js";
import { cell, h, s, show, table, valueCell } from "./dom.js";
import { acceptance, beside, name, quantities } from "./verdict.js";

const ORDER = ["active", "accepted", "proposed", "refused", "retired"];
const day = (utc) => (utc ? utc.replace("T", " ").replace(/(\.\d+)?Z$/, "") : "");

// The first value of the results about one subject, one after the other, with bars of U, or of 2 sd where nobody knows u.
function trend(all, id) {
  const same = all.filter((one) => one.subject === all.find((other) => other.id === id)?.subject && Object.keys(one.result).length > 0).slice(-10);
  const key = Object.keys(same.at(-1)?.result ?? {})[0];
  const points = same.filter((one) => key in one.result).map((one) => ({ id: one.id, text: /(\S+) \+\/- \S+( \S+)?$/.exec(one.text), value: one.result[key], u: one.u?.[key] ?? one.sd[key] ?? 0 }));
  if (points.length < 2) return null;
  const low = Math.min(...points.map((p) => p.value - 2 * p.u)), high = Math.max(...points.map((p) => p.value + 2 * p.u));
  const x = (k) => 50 + (k * 500) / Math.max(1, points.length - 1), y = (v) => 20 + (110 * (high - v)) / (high - low || 1);
  // The digits that U justifies, as the list has them; of many results only the ends and the one that is looked at.
  const told = (p, k) => p.text && (points.length <= 5 || k === 0 || k === points.length - 1 || p.id === id) && s("text", { x: x(k), y: y(p.value + 2 * p.u) - 6, "text-anchor": "middle" }, p.text[1] + (p.text[2] ?? ""));
  return h("figure", null, h("figcaption", null, `${key} of the last ${points.length} results; bars are U (k = 2)`),
    s("svg", { viewBox: "0 0 600 165", role: "img", "aria-label": `Trend of ${key}`, class: "trend" },
      points.map((p, k) => s("g", { class: p.id === id ? "now" : null }, s("line", { x1: x(k), x2: x(k), y1: y(p.value - 2 * p.u), y2: y(p.value + 2 * p.u) }), s("circle", { cx: x(k), cy: y(p.value), r: 5 }), told(p, k), s("text", { x: x(k), y: 158, "text-anchor": "middle" }, p.id)))));
}

export function results(main) {
  let all = [], chosen = Number(location.hash.split("/")[1]) || null, pair = [], known = "", failed = true, down = false;
  const list = h("div"), detail = h("section", { class: "panel" }), said = h("p", { role: "alert", class: "said" });
  show(main, h("h2", { class: "hidden" }, "Results"), h("div", { class: "columns results" }, h("section", { class: "panel" }, list, said), detail));

  function row(one) {
    return h("tr", { class: one.id === chosen ? "chosen" : null },
      h("td", null, h("input", { type: "checkbox", "aria-label": `compare result ${one.id}`, checked: pair.includes(one.id), onchange: (event) => mark(one.id, event.target.checked) })),
      h("td", null, h("button", { class: "plain", onclick: () => choose(one.id) }, `${one.id}`)), cell(one.subject), cell(one.standing), cell(one.method), cell(one.text), cell(day(one.proposed_utc)));
  }
  function draw() {
    const sorted = [...all].sort((a, b) => ORDER.indexOf(a.state) - ORDER.indexOf(b.state) || b.id - a.id);
    show(list, h("h3", null, "Results"), all.length === 0 ? h("p", null, "None yet: ", h("a", { href: "#calibrate" }, "calibrate"), ".") :
      table(["", "No.", "Subject", "State", "Method", "First value", "Measured (UTC)"], sorted.map(row), { label: "Results" }), all.length > 1 && h("p", { class: "small" }, "Tick two to compare them."));
  }
  function mark(id, yes) {
    pair = yes ? [...pair.slice(-1), id] : pair.filter((one) => one !== id);
    draw();
    if (pair.length === 2) compare();
  }
  async function compare() {
    const [one, other] = await Promise.all(pair.map((id) => get("result", { id })));
    const rows = (one.quantities ?? []).map((q) => {
      const same = other.quantities?.find((candidate) => candidate.key === q.key);
      const sd = same && q.sd !== null && same.sd !== null ? Math.hypot(q.sd, same.sd) : 0;
      return h("tr", null, cell(q.name), valueCell(q.text), valueCell(same?.text ?? "none"), cell(sd > 0 ? (Math.abs(q.value - same.value) / sd).toFixed(1) : "", true));
    });
    show(detail, h("h3", null, `Results ${pair[0]} and ${pair[1]}`), table(["Quantity", { text: `${pair[0]}`, n: true }, { text: `${pair[1]}`, n: true }, { text: "apart, sd", n: true }], rows, { label: "Two results" }));
  }
  async function choose(id) {
    chosen = id;
    history.replaceState(null, "", `#results/${id}`);
    draw();
    show(detail, h("p", null, "…"));
    try {
      const one = await get("result", { id });
      const compared = one.state === "proposed" ? beside(await get("comparison", { id })) : null;
      if (chosen !== id) return; // another one was chosen meanwhile
      const summary = all.find((other) => other.id === id);
      const rests = summary?.rests_on ?? [];
      const frame = h("div");
      const back = h("button", { class: "danger", onclick: async () => {
        try { await post("rollback", { id, by: by.value }); await load(); choose(id); } catch (error) { back.nextSibling.textContent = error.message; }
      } }, "Go back to the one before");
      const by = h("input", { value: name(), "aria-label": "who goes back", size: 14 });
      show(detail, h("h3", null, `Result ${id}, ${one.standing}`), h("p", { class: "small" }, `${one.method} · ${one.subject} · ${one.probe} · ${one.machine} · ${one.mounting}`),
        one.refusal && h("p", { class: "verdict failed" }, `${one.refusal.name}: ${one.refusal.reason}`),
        (one.warnings ?? []).map((warning) => h("p", { class: "verdict warned" }, warning)),
        one.quantities && quantities(one), trend(all, id),
        rests.length > 0 && [h("h4", null, "Rests on"), h("ul", null, rests.map((r) => h("li", { class: r.retired ? "failed" : null }, h("a", { href: `#results/${r.id}`, onclick: () => choose(r.id) }, `result ${r.id}`), ` (${r.subject})`, r.retired && ", which is retired: measure this one again")))],
        one.state === "proposed" && [h("h4", null, "Beside the one in force"), compared, acceptance(id, () => { load(); })],
        h("h4", null, "History"), h("ul", { class: "small" }, one.history.map((t) => h("li", null, `${day(t.utc)}  ${t.state}${t.by ? ` by ${t.by}` : ""}${t.remark ? ` (${t.remark})` : ""}`))),
        one.state === "active" && h("p", { class: "bar" }, by, back, h("span", { role: "alert", class: "said" })),
        one.dataset_kept && h("p", { class: "bar" }, h("button", { onclick: () => show(frame, h("iframe", { src: `/api/report?id=${id}`, title: `Report of result ${id}`, sandbox: "" })) }, "Report in place"), h("a", { href: `/api/report?id=${id}`, target: "_blank", rel: "noopener" }, "in a page of its own")), frame);
    } catch (error) {
      if (chosen === id) show(detail, h("p", { class: "verdict failed" }, error.message));
    }
  }
  async function load() {
    const first = failed; // what is looked at stays as it is, with its report, when the list changes
    try {
      all = await get("results");
      failed = false;
      said.textContent = "";
      draw();
      if (first && chosen === null) show(detail, h("p", { class: "small" }, "Choose a result."));
    } catch (error) {
      failed = true;
      said.textContent = error.message;
    }
    detail.classList.toggle("hidden", failed);
    if (first && !failed && chosen !== null) choose(chosen);
  }
  load();
  const offs = [
    on("link", ({ up }) => { if (up && down && failed) load(); down = !up; }),
    on("state", (state) => {
      const now = JSON.stringify([state.newest_result, state.active_results]);
      if (known !== "" && now !== known) load();
      known = now;
    }),
  ];
  return () => { for (const off of offs) off(); };
}

