import { get, on, post } from "./box.js";
import { cell, h, s, say, show, table } from "./dom.js";

const number = (mm) => (mm === null || mm === undefined ? "–" : mm.toFixed(4));
const count = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
const ROTARY = ["a", "b", "c"];
const signed = (mm) => `${mm < 0 ? "-" : "+"}${Math.abs(mm).toFixed(4)}`;

// Lengths of the assemblies in force here: for motion control L4 and W2, for simulation L3 and W1 (CN103801980, C2 to C4).
async function assemblies() {
  const all = await get("results");
  const counts = (one) => one.state === "proposed" || (one.state === "active" && !one.why_not_in_force);
  const some = all.filter((one) => /^assembly-\d+$/.test(one.subject) && counts(one));
  const newest = new Map();
  for (const one of some) if (one.state === "active" || !newest.has(one.subject)) newest.set(one.subject, one);
  return [...newest.values()].map((one) => {
    const of = (key) => ({ value: one.result[key] ?? null, u: one.u?.[key] ?? one.sd[key] ?? null });
    return { tool: Number(one.subject.slice(9)), state: one.state, id: one.id, L3: of("assembled_length_mm"), W: [of("compensation_mm[0]"), of("compensation_mm[1]")], L4: of("compensation_mm[2]") };
  });
}

// W1 counts from the tip to the spindle axis (C3), so the tip is drawn at -W1.
export const across = (W1) => ({ W1_mm: W1, tip_from_axis_mm: W1.map((mm) => 0 - mm) });

// Holder and tool from the side, to scale, with the measured length beside the stored one.
function drawing(tool) {
  const scale = 300 / (tool.holder_length_mm + Math.max(tool.stored_length_mm, tool.assembled_length_mm));
  const box = (x, y, w, height, className) => s("rect", { x, y, width: w, height, class: className });
  const holder = tool.holder_length_mm * scale, long = tool.assembled_length_mm * scale, cut = tool.cutting_mm * scale;
  const rh = tool.holder_radius_mm * scale, r = Math.max(1.5, tool.radius_mm * scale);
  const right = Math.max(40, rh + 10);
  const stored = tool.stored_length_mm * scale, off = tool.tip_from_axis_mm[0] * scale * 50; // 50 times, or nobody would see it
  return s("svg", { viewBox: "-130 -12 300 350", role: "img", "aria-label": `Tool ${tool.number} in its holder`, class: "toolpicture" },
    box(-rh, 0, 2 * rh, holder, "piece"), box(-r + off, holder, 2 * r, long - cut, "piece"), box(-r + off, holder + long - cut, 2 * r, cut, "cutter"),
    s("line", { x1: -118, x2: 118, y1: 0, y2: 0, class: "gauge-line" }), s("text", { x: 60, y: -3 }, "gauge line"),
    s("line", { x1: right, x2: right, y1: holder, y2: holder + long, class: "size" }), s("text", { x: right + 6, y: holder + long / 2 }, `L3 ${number(tool.assembled_length_mm)}`),
    s("line", { x1: -40, x2: -40, y1: holder, y2: holder + stored, class: "size stored" }), s("text", { x: -46, y: holder + stored / 2 + 14, "text-anchor": "end" }, `store ${number(tool.stored_length_mm)}`),
    s("line", { x1: right, x2: right, y1: 0, y2: holder, class: "size" }), s("text", { x: right + 6, y: holder / 2 }, `L1 ${number(tool.holder_length_mm)}`));
}

// Side by side: what simulates the tool is drawn with L3 and W1, what moves it adds L4 and W2.
function lengths(tool, measured) {
  const u = (one) => (one === undefined || one.u === null ? "" : ` ± ${(one.u * 1e3).toFixed(2)} µm`);
  const row = (what, L, simulated, M, moved, one) => h("tr", null, h("th", { scope: "row" }, what), cell(`${L} ${simulated}`, true), cell(`${M} ${signed(moved)}${u(one)}`, true));
  const delta = tool.assembled_length_mm - tool.stored_length_mm;
  return h("div", null, table(["mm", { text: "Simulation", n: true }, { text: "Motion control", n: true }], [
    row("Length", "L3", number(tool.assembled_length_mm), "L4", measured?.L4.value ?? delta, measured?.L4),
    row("X", "W1", signed(tool.W1_mm[0]), "W2", measured?.W[0].value ?? tool.W1_mm[0], measured?.W[0]),
    row("Y", "W1", signed(tool.W1_mm[1]), "W2", measured?.W[1].value ?? tool.W1_mm[1], measured?.W[1])], { label: "Lengths" }),
  h("p", { class: "small" }, measured ? `Result ${measured.id}, ${measured.state}: L3 is ${signed(delta)} mm against the store.` : tool.measured ? `As cell.toml has them: L3 is ${signed(delta)} mm against the store.` : "Not measured: the lengths in store.", ` The store is that of ${tool.of_the_box ? "the box" : "cell.toml"}.`,
    " L3: from the holder's face to the tip; W1: of the axis from the tip. L4: to add to the stored length; W2: to add to the position of the tip. Behind ±: u (k = 1)."));
}

export function tools(main) {
  let picture = null, tool = null, scene = null, measured = [], inStore = [], alive = true, follow = true;
  const choose = h("select", { "aria-label": "Tool" }), holder = h("div", { class: "scene" }), side = h("div"), numbers = h("div");
  const near = h("p", { class: "verdict neutral", role: "status" }, "…"), said = h("p", { role: "alert", class: "said" }), outcome = h("div");
  const program = h("textarea", { id: "program", rows: 8, spellcheck: "false", placeholder: "G21 G90\nG0 X0 Y0 Z50\nG1 Z-5 F200" });
  const stored = h("input", { type: "checkbox" });
  show(main, h("h2", { class: "hidden" }, "Tools"), h("p", null, "…"));

  // What the box measured, and has in store, comes before what cell.toml states.
  function withMeasured(described) {
    const found = measured.find((other) => other.tool === described.number && other.state === "active");
    const kept = inStore.find((other) => other.number === described.number);
    const one = !kept ? described : { ...described, of_the_box: true, holder_length_mm: kept.holder_length_mm, stored_length_mm: kept.length_mm,
      assembled_length_mm: described.measured ? described.assembled_length_mm : kept.length_mm };
    if (!found || found.L3.value === null) return one;
    return { ...one, assembled_length_mm: found.L3.value, ...across(found.W.map((one) => one.value ?? 0)), measured: true };
  }
  function pick(number_) {
    tool = withMeasured(scene.tools.find((one) => one.number === number_));
    show(side, drawing(tool));
    show(numbers, lengths(tool, measured.find((one) => one.tool === tool.number)));
    picture.setTool(tool);
  }
  let asked = 0;
  // Where the machine stands: an axis of the cell whose angle the box does not know is drawn at 0, and that is said.
  function angles(state) {
    const told = ROTARY.map((letter) => state.corrections.rotary_axes?.find((one) => one.axis.toLowerCase() === letter));
    const unknown = scene.rotary.map((axis) => axis.letter).filter((letter) => (told["ABC".indexOf(letter)]?.angle_deg ?? null) === null);
    return { at: told.map((one) => one?.angle_deg ?? 0), unknown };
  }
  const stands = ({ at, unknown }) => scene.rotary.map(({ letter }) => (unknown.includes(letter) ? `${letter} unknown, taken as 0` : `${letter} ${at["ABC".indexOf(letter)].toFixed(3)}°`)).join(", ");
  async function look(position, turned) {
    picture.moveTool(position, turned.at);
    if (performance.now() - asked < 900) return;
    asked = performance.now();
    try {
      const lengths_ = { holder: tool.holder_length_mm, length: tool.assembled_length_mm, w1x: tool.W1_mm[0], w1y: tool.W1_mm[1] };
      const nearest = await get("nearest", { tool: tool.number, ...lengths_, x: position[0], y: position[1], z: position[2], ...Object.fromEntries(ROTARY.map((letter, k) => [letter, turned.at[k]])) });
      if (!follow || !alive) return;
      tellNearest(nearest, `Where the machine stands now${scene.rotary.length > 0 ? ` (${stands(turned)})` : ""}: `);
    } catch (error) {
      near.className = "verdict warned";
      say(near, error.message);
    }
  }
  function tellNearest(nearest, where) {
    if (nearest === null || nearest.solid === "") { say(near, "Nothing is in the cell."); return; }
    const hit = nearest.distance_mm <= scene.least_mm;
    near.className = `verdict ${hit ? "failed" : "pass"}`;
    say(near, `${where}${nearest.tool_part} and ${nearest.solid}: ${hit && nearest.distance_mm === 0 ? "they touch" : `${nearest.distance_mm.toFixed(3)} mm`}`);
    picture.showPair(nearest, hit);
  }
  async function run(event) {
    event.preventDefault();
    say(said, "");
    try {
      const lengths_ = stored.checked ? { assembled_mm: tool.stored_length_mm, W1_mm: [0, 0] } : { assembled_mm: tool.assembled_length_mm, W1_mm: tool.W1_mm };
      const report = await post("check", { tool: tool.number, program: program.value, measured: { holder_mm: tool.holder_length_mm, ...lengths_ } });
      follow = false;
      picture.showPath(report, scene.program_zero_mm);
      picture.showLeft(report.left, scene.solids);
      const goTo = (hit) => { picture.moveTool(hit.tip_mm, hit.angles_deg); tellNearest(hit, `Line ${hit.line}: `); };
      const rows = report.hits.slice(0, 50).map((hit) => h("tr", null, h("td", { class: "n" }, h("button", { type: "button", class: "plain", onclick: () => goTo(hit) }, hit.line)), cell(hit.tool_part), cell(hit.solid), cell(hit.overlap_mm > 0 ? `${hit.overlap_mm.toFixed(3)} deep` : hit.distance_mm.toFixed(3), true)));
      show(outcome, h("p", { class: `verdict ${report.hits.length > 0 ? "failed" : "pass"}` }, report.hits.length > 0 ? `${count(report.hits.length, "hit")} in ${count(report.moves, "move")}` : `No hit in ${count(report.moves, "move")}, ${report.path_mm.toFixed(0)} mm`, report.nearest && report.hits.length === 0 ? `; nearest ${report.nearest.distance_mm.toFixed(3)} mm: ${report.nearest.tool_part} and ${report.nearest.solid}, line ${report.nearest.line}` : "", `. ${report.removed_mm3.toFixed(0)} mm³ are cut.`),
        rows.length > 0 && table([{ text: "Line", n: true }, "Tool", "Solid", { text: "mm", n: true }], rows, { label: "Hits" }));
      const worst = report.hits[0] ?? report.nearest;
      if (worst) goTo(worst);
    } catch (error) {
      say(said, error.message);
    }
  }

  const offs = [];
  let failed = false;
  const begin = () => Promise.all([get("cell"), assemblies(), import("./scene.js"), get("stores").catch(() => [])]).then(([told, some, { Picture }, stores]) => { // a recording has none
    if (!alive) return;
    failed = false;
    inStore = stores;
    measured = some;
    if (told === null) {
      show(main, h("section", { class: "panel" }, h("h3", null, "Tools"), measured.length === 0 ? h("p", null, "No assembly of tool and holder has been measured: ", h("a", { href: "#calibrate" }, "calibrate"), " tool-assembly.") :
        measured.map((one) => [h("h4", null, `Tool ${one.tool}`), table(["", { text: "mm", n: true }], [["L3, for simulation", one.L3], ["L4, for motion control", one.L4], ["W1 and W2, X", one.W[0]], ["W1 and W2, Y", one.W[1]]].map(([name, q]) => h("tr", null, cell(name), cell(number(q.value), true))), { label: `Tool ${one.tool}` })]),
        h("p", { class: "small" }, "For pictures and interference start ", h("code", null, "probebox view --cell cell.toml"), ": a description of machine, fixture, workpiece and tools.")));
      return;
    }
    scene = told;
    show(choose, scene.tools.map((one) => h("option", { value: one.number }, `Tool ${one.number}`)));
    show(main, h("h2", { class: "hidden" }, "Tools"), h("div", { class: "columns results" },
      h("div", null, h("div", { class: "bar" }, choose, h("button", { onclick: () => picture.home() }, "Whole cell"), h("button", { onclick: () => { follow = true; asked = 0; picture.showPath({ from: null }); picture.showLeft([], scene.solids); } }, "Where the machine stands")), holder, near),
      h("section", { class: "panel" }, side, numbers, h("form", { onsubmit: run }, h("h4", null, h("label", { for: "program" }, "Check a program")), program,
        h("p", { class: "bar" }, h("label", null, stored, " with the stored lengths"), h("button", { class: "primary" }, "Check")), said, outcome))));
    if (scene.tools.length === 0) { show(main, h("p", { class: "verdict warned" }, "The cell has no [[tool]].")); return; }
    choose.addEventListener("change", () => pick(Number(choose.value)));
    picture = new Picture(holder, scene);
    pick(scene.tools[0].number);
    offs.push(on("state", (state) => {
      if (!follow || !state.corrections) return;
      const position = state.corrections.axes.map((axis) => axis.position_mm);
      if (position.every((mm) => mm !== null)) look(position, angles(state));
    }));
  }).catch((error) => { failed = true; if (alive) show(main, h("p", { class: "verdict failed" }, error.message)); });
  begin();
  offs.push(on("link", ({ up }) => { if (up && failed) begin(); }));
  return () => { alive = false; for (const off of offs) off(); picture?.dispose(); };
}

