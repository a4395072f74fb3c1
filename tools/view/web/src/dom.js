// Elements from nested calls. Whatever comes from the box becomes text, never markup.
const SVG = "http://www.w3.org/2000/svg";

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  for (const child of children.flat(3)) {
    if (child === null || child === undefined || child === false) continue;
    element.append(child instanceof Node ? child : document.createTextNode(String(child)));
  }
  return element;
}

export const h = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
export const s = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);

// Says only what has changed, so that a screen reader is not told everything twice a second.
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// What had the focus in what is replaced keeps it, where the new content has the same link or field.
export function show(element, ...children) {
  const held = element.contains(document.activeElement) ? document.activeElement : null;
  const same = held && ["id", "href", "name", "aria-label"].filter((name) => held.getAttribute(name)).map((name) => `[${name}="${CSS.escape(held.getAttribute(name))}"]`)[0];
  element.replaceChildren(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
  if (same && !held.isConnected) element.querySelector(same)?.focus({ preventScroll: true });
}

export function table(head, rows, attributes) {
  return h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": attributes?.label ?? "table" },
    h("table", { class: attributes?.class },
      h("thead", null, h("tr", null, head.map((cell) => h("th", { scope: "col", class: cell.n ? "n" : cell.narrow ? "narrow" : null }, cell.text ?? cell)))),
      h("tbody", null, rows)));
}

// "5.2 us, sd 0.1 us": the value, and under it how well it is known, so that two columns of them fit beside each other.
export function valueCell(text) {
  const [value, ...rest] = text.split(", ");
  return h("td", { class: "n" }, value, rest.map((one) => [h("br"), h("small", null, one)]));
}

export const cell = (text, n) => h("td", { class: n ? "n" : null }, text);

// The name of a decisive value, and the value itself, which is never broken, with what stands behind it.
export function named(decisive, ...more) {
  const rest = decisive.text.startsWith(decisive.name) ? decisive.text.slice(decisive.name.length).trim() : decisive.text;
  return [h("span", { class: "what" }, decisive.name), h("span", { class: "number" }, rest, more)];
}
