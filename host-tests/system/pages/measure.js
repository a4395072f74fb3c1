// Runs in a page that render_pages.py has opened, and writes what is wrong with it into the title.
(() => {
  const wrong = [];
  const words = (element) => element.textContent.trim().slice(0, 40);

  const parse = (text) => {
    const parts = text.match(/[\d.]+/g);
    return parts === null ? null : parts.map(Number);
  };
  // WCAG 2.2: relative luminance and contrast.
  const luminance = (rgb) => {
    const [r, g, b] = rgb.map((part) => part / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const contrast = (one, other) => {
    const [low, high] = [luminance(one), luminance(other)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  const opaque = (colour) => colour !== null && (colour.length < 4 || colour[3] > 0);
  const groundOf = (element) => {
    for (let at = element; at !== null; at = at.parentElement) {
      const own = parse(getComputedStyle(at).backgroundColor);
      if (opaque(own)) return own.slice(0, 3);
    }
    return [255, 255, 255];
  };

  for (const element of document.body.querySelectorAll("*:not(svg *)")) {
    if (element.clientWidth > 0 && element.scrollWidth > element.clientWidth + 1) wrong.push(`wider than its place: ${element.tagName} "${words(element)}"`);
    const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim() !== "");
    if (!own) continue;
    const seen = contrast(parse(getComputedStyle(element).color).slice(0, 3), groundOf(element));
    if (seen < 4.5) wrong.push(`contrast ${seen.toFixed(2)}: "${words(element)}"`);
  }
  for (const svg of document.querySelectorAll("svg")) {
    const frame = svg.viewBox.baseVal;
    const ground = parse(getComputedStyle(svg.querySelector("rect")).fill).slice(0, 3);
    const corner = svg.getScreenCTM().inverse();
    for (const text of svg.querySelectorAll("text")) {
      const box = text.getBoundingClientRect();
      const from = new DOMPoint(box.left, box.top).matrixTransform(corner);
      const to = new DOMPoint(box.right, box.bottom).matrixTransform(corner);
      if (from.x < -1 || from.y < -1 || to.x > frame.width + 1 || to.y > frame.height + 1) wrong.push(`text is cut: "${words(text)}"`);
      const seen = contrast(parse(getComputedStyle(text).fill).slice(0, 3), ground);
      if (seen < 4.5) wrong.push(`contrast ${seen.toFixed(2)} in a picture: "${words(text)}"`);
    }
    for (const drawn of svg.querySelectorAll("polyline, circle, path")) {
      const style = getComputedStyle(drawn);
      const colour = parse(drawn.tagName === "polyline" ? style.stroke : style.fill);
      if (colour === null) { wrong.push("a colour is missing"); continue; }
      if (contrast(colour.slice(0, 3), ground) < 3) { wrong.push(`a series has too little contrast: ${colour}`); break; }
    }
  }
  const root = document.documentElement;
  if (root.scrollWidth > root.clientWidth + 1) wrong.push(`the page is wider than the window: ${root.scrollWidth}`);
  const scheme = parse(getComputedStyle(document.body).backgroundColor)[0] < 128 ? "dark" : "light";
  const rows = new Set([...document.querySelectorAll(".pictures svg")].map((svg) => Math.round(svg.getBoundingClientRect().top)));
  document.title = JSON.stringify({ wrong: [...new Set(wrong)], scheme, pictures: document.querySelectorAll(".pictures svg").length, rows: rows.size });
})();
