// Colours and drawing that sheet and matrix share. All files of the page are one script.

/** Colours from one end of a scale to the other; both maps keep their order for colour-blind eyes. */
const MAPS = {
  // Orange below zero and blue above it, as on the pages of reports.
  light: ["#94390c", "#dc7a3c", "#f6c39a", "#f4f4f2", "#b5d3e7", "#5d94c8", "#1d4f91"],
  dark: ["#ffd0a3", "#d47c3d", "#7a4420", "#1e252d", "#27507c", "#4f8fd0", "#9cc7f5"],
  // Cividis.
  sequential: ["#00224e", "#2a3f6d", "#575d6d", "#7d7c78", "#a59c74", "#d2c060", "#fee838"],
};
const isDark = matchMedia("(prefers-color-scheme: dark)");

/** 256 colours of each map, and the colour of text that can be read on each. */
const TABLES = {};
for (const [name, stops] of Object.entries(MAPS)) {
  const parts = stops.map((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  TABLES[name] = Array.from({ length: 256 }, (_, index) => {
    const at = index / 255 * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
    const rgb = parts[low].map((value, axis) => Math.round(value + (parts[low + 1][axis] - value) * (at - low)));
    return { css: `rgb(${rgb})`, ink: 0.3 * rgb[0] + 0.59 * rgb[1] + 0.11 * rgb[2] > 135 ? "#10161c" : "#ffffff" };
  });
}

/** Colour at `share`, 0 to 1, of the map for signed values or of the one for the others. */
function shade(isSigned, share) {
  const table = TABLES[!isSigned ? "sequential" : isDark.matches ? "dark" : "light"];
  return table[Math.max(0, Math.min(255, Math.round(share * 255)))];
}

const theme = {};
function readTheme() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["line", "text", "quiet", "hatch", "force", "depth", "grid", "bad", "warn"]) {
    theme[name] = style.getPropertyValue(`--${name}`).trim();
  }
  const tile = document.createElement("canvas"), context = tile.getContext("2d");
  tile.width = tile.height = 6;
  context.strokeStyle = theme.hatch;
  for (const at of [-6, 0, 6]) {
    context.moveTo(at - 1, 7);
    context.lineTo(at + 7, -1);
  }
  context.stroke();
  theme.hatched = context.createPattern(tile, "repeat");
}

const FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif";

/** Fits a canvas to its place and the screen's pixels; returns its context, in CSS pixels. */
function prepare(canvas, height) {
  const width = canvas.clientWidth, ratio = devicePixelRatio || 1;
  const size = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== size[0] || canvas.height !== size[1]) {
    [canvas.width, canvas.height] = size;
    canvas.style.height = `${height}px`;
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

function write(context, text, x, y, { align = "center", colour = theme.quiet, size = 11.5, weight = 400 } = {}) {
  context.font = `${weight} ${size}px ${FONT}`;
  context.textAlign = align;
  context.textBaseline = "middle";
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

function box(context, fill, x, y, width, height) {
  context.fillStyle = fill;
  context.fillRect(x, y, width, height);
}

/** Line through points. */
function line(context, points) {
  points.forEach(([x, y], index) => index ? context.lineTo(x, y) : context.moveTo(x, y));
}

/** Bar with a map's colours, ticks below it and a title before it. */
function legend(context, isSigned, x, y, width, ticks, title) {
  write(context, title, x, y + 5, { align: "left" });
  const left = x + context.measureText(title).width + 8, length = width - (left - x);
  const ramp = context.createLinearGradient(left, 0, left + length, 0);
  for (let stop = 0; stop <= 12; stop++) ramp.addColorStop(stop / 12, shade(isSigned, stop / 12).css);
  box(context, ramp, left, y, length, 10);
  ticks.forEach((tick, index) => {
    const align = index === 0 ? "left" : index === ticks.length - 1 ? "right" : "center";
    write(context, tick, left + length * index / (ticks.length - 1), y + 19, { align });
  });
}

/** Number with fixed digits; a dash for what is missing. */
function digits(value, places = 2) {
  return Number.isFinite(value) ? value.toFixed(places).replace(/^-(?=[0.]*$)/, "").replace("-", "−") : "–";
}
/** Value with three significant digits. */
function short(value) {
  const size = Math.abs(value);
  return value === 0 ? "0" : digits(value, size >= 99.95 ? 0 : size >= 9.995 ? 1 : size >= 0.9995 ? 2 : 3);
}
/** Round number without idle zeros. */
const plain = (value) => `${+value.toPrecision(3)}`.replace("-", "−");
