// Colours and drawing that sheet and matrix share. All files of the page are one script.

/** Colours from one end of a scale to the other; both maps keep their order for colour-blind eyes. */
const MAPS = {
  diverging: {
    light: ["#1d4f91", "#5d94c8", "#b5d3e7", "#f4f4f2", "#f6c39a", "#dc7a3c", "#94390c"],
    dark: ["#9cc7f5", "#4f8fd0", "#27507c", "#1e252d", "#7a4420", "#d47c3d", "#ffd0a3"],
  },
  // Cividis.
  sequential: {
    light: ["#00224e", "#2a3f6d", "#575d6d", "#7d7c78", "#a59c74", "#d2c060", "#fee838"],
    dark: ["#00224e", "#2a3f6d", "#575d6d", "#7d7c78", "#a59c74", "#d2c060", "#fee838"],
  },
};
const isDark = matchMedia("(prefers-color-scheme: dark)");

const parts = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

/** Tables of 256 colours [r, g, b] by map and theme. */
const TABLES = Object.fromEntries(Object.entries(MAPS).map(([name, themes]) => [name,
  Object.fromEntries(Object.entries(themes).map(([theme, stops]) => [theme,
    Array.from({ length: 256 }, (_, index) => {
      const at = index / 255 * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
      const [from, to] = [parts(stops[low]), parts(stops[low + 1])];
      return from.map((value, axis) => Math.round(value + (to[axis] - value) * (at - low)));
    })]))]));

/** Colour [r, g, b] at `share`, 0 to 1, of a map. */
function shade(map, share) {
  const table = TABLES[map][isDark.matches ? "dark" : "light"];
  return table[Math.max(0, Math.min(255, Math.round(share * 255)))];
}

const css = ([r, g, b], alpha = 1) => `rgba(${r},${g},${b},${alpha})`;
/** Text colour that can be read on a colour. */
const inkOn = ([r, g, b]) => 0.3 * r + 0.59 * g + 0.11 * b > 135 ? "#10161c" : "#ffffff";

let theme = {};
function readTheme() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["card", "line", "text", "quiet", "hatch", "arrow", "force", "depth", "grid", "accent", "bad", "warn"]) {
    theme[name] = style.getPropertyValue(`--${name}`).trim();
  }
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
  return [context, width];
}

function write(context, text, x, y, { align = "center", colour = theme.quiet, size = 11.5, weight = 400 } = {}) {
  context.font = `${weight} ${size}px ${FONT}`;
  context.textAlign = align;
  context.textBaseline = "middle";
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

/** Hatched ground, which shows through where an output is uncertain. */
function hatch(context, x, y, width, height) {
  context.save();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  context.strokeStyle = theme.hatch;
  context.lineWidth = 1;
  context.beginPath();
  for (let at = x - height; at < x + width; at += 5) {
    context.moveTo(at, y + height);
    context.lineTo(at + height, y);
  }
  context.stroke();
  context.restore();
}

/** Bar with a map's colours, ticks below it and a title before it. */
function legend(context, map, x, y, width, ticks, title) {
  write(context, title, x, y + 5, { align: "left" });
  const left = x + context.measureText(title).width + 8, length = width - (left - x);
  for (let at = 0; at < length; at++) {
    context.fillStyle = css(shade(map, at / (length - 1)));
    context.fillRect(left + at, y, 1.5, 10);
  }
  ticks.forEach((tick, index) => {
    const align = index === 0 ? "left" : index === ticks.length - 1 ? "right" : "center";
    write(context, tick, left + length * index / (ticks.length - 1), y + 19, { align });
  });
}

/** Number with as many digits as are worth reading; a dash for what is missing. */
function digits(value, places = 2) {
  return value === null || value === undefined || !isFinite(value) ? "–" : value.toFixed(places).replace("-", "−");
}
/** Value with three significant digits. */
function short(value) {
  if (value === null || value === undefined || !isFinite(value)) return "–";
  const size = Math.abs(value);
  return digits(value, size >= 99.95 ? 0 : size >= 9.995 ? 1 : size >= 0.9995 ? 2 : 3);
}
