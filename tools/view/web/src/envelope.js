// Draws bands from a minimum to a maximum, pixel by pixel: what a picture costs depends on its size and not on the signal, as that of
// lines does, so noise from edge to edge is drawn as quickly as a line.
const OPAQUE = 0xff000000, SHADE = 0x55000000, CROSSED = 0x80000000;
const opacity = (pixel) => pixel & 0xff000000;
// Of two shades, the colour in between.
const mixed = (one, other) => ((((one & 0xfefefe) >>> 1) + ((other & 0xfefefe) >>> 1)) | CROSSED) >>> 0;

// A colour of the page (#rgb or #rrggbb) as a pixel of ImageData without its opacity.
function pixelOf(colour) {
  const digits = colour.length === 4 ? [...colour.slice(1)].map((one) => one + one).join("") : colour.slice(1);
  const value = parseInt(digits, 16);
  return ((value & 0xff) << 16) | (value & 0xff00) | (value >> 16);
}

export class Envelope {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.context = this.canvas.getContext("2d");
  }

  // plot: of uPlot, whose series are the maximum and minimum of each channel in turn. colours: one each channel.
  draw(plot, colours) {
    const { left, top, width, height } = plot.bbox;
    if (width < 1 || height < 1 || plot.data[0].length === 0) return;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
      this.image = this.context.createImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
    }
    this.pixels.fill(0);
    colours.forEach((colour, k) => { if (plot.series[2 * k + 1].show) this.band(plot, 2 * k + 1, pixelOf(colour)); });
    this.context.putImageData(this.image, 0, 0);
    plot.ctx.drawImage(this.canvas, left, top);
  }

  // Slots are further apart than pixels, or closer: between two the band goes straight on, within a pixel it takes in both.
  band(plot, series, pixel) {
    const { min: from, max: to } = plot.scales.x, { min: low, max: high } = plot.scales.y;
    const times = plot.data[0], highs = plot.data[series], lows = plot.data[series + 1];
    const [first, last] = plot.series[0].idxs ?? [0, times.length - 1];
    const across = this.canvas.width / (to - from), down = this.canvas.height / (high - low);
    let column = null, top = 0, bottom = 0;
    this.before = null;
    for (let k = Math.max(0, first - 1); k <= Math.min(times.length - 1, last + 1); ++k) {
      if (highs[k] === null) {
        if (column !== null) this.column(column, top, bottom, pixel);
        column = this.before = null;
        continue;
      }
      const x = Math.floor((times[k] - from) * across), t = (high - highs[k]) * down, b = (high - lows[k]) * down;
      if (x === column) {
        top = Math.min(top, t);
        bottom = Math.max(bottom, b);
        continue;
      }
      if (column !== null) {
        this.column(column, top, bottom, pixel);
        const steps = x - column;
        for (let step = Math.max(1, -column); step < steps && column + step < this.canvas.width; ++step) this.column(column + step, top + ((t - top) * step) / steps, bottom + ((b - bottom) * step) / steps, pixel);
      }
      [column, top, bottom] = [x, t, b];
    }
    if (column !== null) this.column(column, top, bottom, pixel);
  }

  // One column of pixels: the lines of maximum and minimum go on from the column before, and between them is a shade.
  column(x, top, bottom, pixel) {
    const before = this.before;
    this.before = [top, bottom];
    const { width, height } = this.canvas;
    if (x < 0 || x >= width) return;
    const [above, below] = before ?? [top, bottom];
    const line = Math.max(1, Math.round(1.6 * devicePixelRatio));
    const begin = (y) => Math.max(0, Math.round(y - line / 2)), end = (y) => Math.min(height, Math.round(y - line / 2) + line);
    const from = begin(top), to = end(bottom);
    for (let at = from * width + x; at < to * width; at += width) {
      const there = opacity(this.pixels[at]) >>> 0;
      if (there === 0) this.pixels[at] = pixel | SHADE;
      else if (there === SHADE) this.pixels[at] = mixed(this.pixels[at], pixel);
    }
    for (const [a, b] of [[top, above], [bottom, below]])
      for (let at = begin(Math.min(a, b)) * width + x, last = end(Math.max(a, b)) * width; at < last; at += width) this.pixels[at] = pixel | OPAQUE;
  }
}
