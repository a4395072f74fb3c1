import { get, on, post } from "./box.js";
import { cell, h, named, show, table, valueCell } from "./dom.js";
import { keeping, state } from "./icons.js";
import { restsOn } from "./rests_on.js";
import { trendFigure } from "./trend.js";
import { acceptance, beside, decision, name, quantities } from "./verdict.js";

const FEW = 6; // results of a subject that the list shows before somebody asks for all
const day = (utc) => (utc ? utc.replace("T", " ").replace(/(:\d\d)?(\.\d+)?Z$/, "") : "");
const aside = (one) => [one.probe, one.machine, one.mounting].filter(Boolean).join(" · ");

export function results(main) {
  let all = [], chosen = Number(location.hash.split("/")[1]) || null, pair = [], known = "", failed = true, down = false;
  const whole = new Set(); // subjects of which every result is listed
  const list = h("div"), detail = h("section", { class: "panel" }), said = h("p", { role: "alert", class: "said" });
  show(main, h("h2", { class: "hidden" }, "Results"), h("div", { class: "columns results" }, h("section", { class: "panel", "aria-label": "All results" }, list, said), detail));

  // Two results can be compared where they are about the same.
  const partner = (one) => pair.length === 0 || pair.includes(one.id) || all.find((other) => other.id === pair[0])?.subject === one.subject;
  function row(one) {
    const [kind, word] = keeping(one.decisive);
    return h("tr", { class: one.id === chosen ? "chosen" : null },
      h("td", null, one.decisive && h("input", { type: "checkbox", "aria-label": `compare result ${one.id}`, title: partner(one) ? "Tick two to compare them" : "about something else: it cannot be compared", disabled: !partner(one), checked: pair.includes(one.id), onchange: (event) => mark(one.id, event.target.checked) })),
      h("td", null, h("button", { class: "plain", "aria-current": one.id === chosen ? "true" : null, onclick: () => choose(one.id) }, `${one.id}`)),
      h("td", { class: "value" }, one.decisive ? named(one.decisive, one.decisive.limit !== null && [" ", state(kind, h("span", { class: "hidden" }, word))]) : one.state === "refused" ? "refused" : "no value with an uncertainty"), cell(one.standing), h("td", { class: "narrow number" }, day(one.proposed_utc).slice(0, 10)));
  }
  function subject([title, some]) {
    const shown = whole.has(title) ? some : some.slice(0, FEW), newest = some.find((one) => one.state === "active") ?? some[0];
    return h("section", { class: "subject full" }, h("div", { class: "head" }, h("h3", null, title), newest.decisive && newest.decisive.limit !== null && state(...keeping(newest.decisive))),
      table(["", "No.", "Decisive value", "State", { text: "Measured", narrow: true }], shown.map(row), { label: title }),
      shown.length < some.length && h("button", { class: "plain", onclick: () => { whole.add(title); draw(); } }, `${some.length - shown.length} earlier ones`));
  }
  function draw() {
    const groups = new Map();
    for (const one of [...all].sort((a, b) => b.id - a.id)) groups.set(one.title, [...(groups.get(one.title) ?? []), one]);
    show(list, all.length === 0 ? h("p", null, "None yet: ", h("a", { href: "#calibrate" }, "calibrate"), ".") : [h("p", { class: "small" }, "± is the standard uncertainty u (k = 1). Tick two of a subject to compare them."), [...groups].map(subject)]);
  }
  function mark(id, yes) {
    pair = yes ? [...pair.slice(-1), id] : pair.filter((one) => one !== id);
    draw();
    if (pair.length === 2) compare();
  }
  async function compare() {
    const asked = [...pair].sort((a, b) => b - a);
    let both;
    try {
      both = await Promise.all(asked.map((id) => get("result", { id })));
    } catch (error) {
      return show(detail, h("p", { class: "verdict failed" }, error.message));
    }
    if (asked.some((id) => !pair.includes(id))) return; // others were ticked meanwhile
    const [one, other] = both;
    const rows = (one.quantities ?? []).map((q) => {
      const same = other.quantities?.find((candidate) => candidate.key === q.key);
      const sd = same && q.sd !== null && same.sd !== null ? Math.hypot(q.sd, same.sd) : 0;
      return h("tr", null, cell(q.name), valueCell(q.text), valueCell(same?.text ?? "not found"), cell(sd > 0 ? (Math.abs(q.value - same.value) / sd).toFixed(1) : "", true));
    });
    show(detail, h("h3", null, `${one.title}: results ${one.id} and ${other.id}`), table(["Quantity", { text: `Result ${one.id}`, n: true }, { text: `Result ${other.id}`, n: true }, { text: "apart, sd", n: true }], rows, { label: "Two results" }));
  }
  function goingBack(id) {
    const by = h("input", { value: name(), "aria-label": "who goes back", size: 14 }), alarm = h("span", { role: "alert", class: "said" });
    const back = h("button", { class: "danger", onclick: async () => {
      try { await post("rollback", { id, by: by.value }); await load(); choose(id); } catch (error) { alarm.textContent = error.message; }
    } }, "Go back to the one before");
    return h("p", { class: "bar" }, by, back, alarm);
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
      const frame = h("div"), drawing = restsOn(all, id);
      const retired = (all.find((other) => other.id === id)?.rests_on ?? []).filter((r) => r.retired);
      show(detail, h("div", { class: "bar" }, h("h3", null, `${one.title}: result ${id}`), h("span", { class: "small" }, one.standing)), decision(one),
        (one.warnings ?? []).map((warning) => h("p", { class: "verdict warned" }, warning)),
        retired.map((r) => h("p", { class: "verdict warned" }, `It rests on result ${r.id}, which is retired: measure this one again.`)),
        one.state === "proposed" && [acceptance(id, () => { load(); }), h("h4", null, "Beside the one in force"), compared],
        (one.trend?.points.length ?? 0) > 1 && [h("h4", null, "Trend"), trendFigure(one.trend, { chosen: id })],
        one.quantities && [h("h4", null, "Values"), quantities(one)], drawing && [h("h4", null, "What rests on what"), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "What rests on what" }, drawing)],
        h("h4", null, "History"), h("ul", { class: "small" }, one.history.map((t) => h("li", null, `${day(t.utc)}  ${t.state}${t.by ? ` by ${t.by}` : ""}${t.remark ? ` (${t.remark})` : ""}`))),
        h("p", { class: "small" }, `${one.method_title} · ${aside(one)}`), one.state === "active" && goingBack(id),
        one.dataset_kept && h("p", { class: "bar" }, h("button", { onclick: () => show(frame, h("iframe", { src: `/api/report?id=${id}`, title: `Report of result ${id}`, sandbox: "" })) }, "Report in place"), h("a", { href: `/api/report?id=${id}`, target: "_blank", rel: "noopener" }, "in a page of its own")), frame);
      if (matchMedia("(max-width: 860px)").matches) detail.scrollIntoView();
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
  const followed = () => { const id = Number(location.hash.split("/")[1]); if (location.hash.startsWith("#results/") && id && id !== chosen) choose(id); };
  addEventListener("hashchange", followed);
  const offs = [
    on("link", ({ up }) => { if (up && down && failed) load(); down = !up; }),
    on("state", (news) => {
      const now = JSON.stringify([news.newest_result, news.active_results]);
      if (known !== "" && now !== known) load();
      known = now;
    }),
    () => removeEventListener("hashchange", followed),
  ];
  return () => { for (const off of offs) off(); };
}
