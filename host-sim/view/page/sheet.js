// The sheet: deformation of the electrodes, flat or in three dimensions.

const START_TURN = { yaw: -0.55, pitch: 0.95 };
const sheet = { is3d: false, hasNumbers: false, scale: 1, turn: { ...START_TURN }, spots: [] };

/** Places of a layout's electrodes, put into a grid if they form one. */
function shapeOf(layout) {
  const places = layout.electrodes.map((electrode) => electrode.place_mm);
  const sorted = (axis) => [...new Set(places.map((place) => place[axis]))].sort((a, b) => a - b);
  const [xs, ys] = [sorted(0), sorted(1)];
  const pitch = (values) => values.length > 1 ? (values.at(-1) - values[0]) / (values.length - 1) : null;
  const step = [pitch(xs) ?? pitch(ys) ?? 1, pitch(ys) ?? pitch(xs) ?? 1];
  const isGrid = xs.length * ys.length === places.length;
  let at = null;
  if (isGrid) {
    at = ys.map(() => new Array(xs.length).fill(0));
    places.forEach((place, index) => { at[ys.indexOf(place[1])][xs.indexOf(place[0])] = index; });
  } else {
    // Scattered electrodes: about as many as would fill the face evenly.
    const area = (xs.at(-1) - xs[0]) * (ys.at(-1) - ys[0]) || 1;
    step.fill(Math.sqrt(area / places.length));
  }
  const low = [xs[0] - step[0] / 2, ys[0] - step[1] / 2], high = [xs.at(-1) + step[0] / 2, ys.at(-1) + step[1] / 2];
  const height = Math.max(...places.map((place) => place[2]), 0);
  return { places, at, step, low, high, height };
}

/** Values of one electrode by axis: of outputs, deviations or truth. */
const axesOf = (electrode, values) => electrode.outputs.map((index) => index === null ? null : values?.[index] ?? null);

/** Opacity that says how certain an output is. */
const opacity = (deviation) => deviation === null ? 1 : Math.max(0.12, 1 - 2 * deviation / sheet.scale);
const zShare = (dz) => 0.5 + dz / sheet.scale / 2;

function drawSheet(canvas, layout, shape, frame) {
  const panels = [["decoded", frame?.outputs ?? [], frame?.deviations ?? null]];
  if (frame?.truth) panels.push(["truth", frame.truth, null]);
  const width = canvas.clientWidth, across = panels.length > 1 && width > 560 ? 2 : 1;
  const down = panels.length / across, panelWidth = width / across;
  const ratio = (shape.high[1] - shape.low[1]) / (shape.high[0] - shape.low[0]);
  const limit = Math.max(300, innerHeight - 330) / down;
  const panelHeight = Math.max(180, Math.min((panelWidth - 60) * (sheet.is3d ? 0.8 : ratio) + 54, limit));
  const height = panelHeight * down + 44;
  const [context] = prepare(canvas, height);
  sheet.spots = [];
  panels.forEach(([title, values, deviations], index) => {
    const box = { x: (index % across) * panelWidth, y: Math.floor(index / across) * panelHeight, width: panelWidth, height: panelHeight };
    if (panels.length > 1) write(context, title, box.x + 40, box.y + 8, { align: "left", colour: theme.text, weight: 600, size: 12.5 });
    (sheet.is3d ? drawSolid : drawFlat)(context, box, layout, shape, frame, values, deviations, index === 0);
  });
  drawKey(context, width, height, shape, frame?.deviations);
  canvas.setAttribute("aria-label", frame?.contact
    ? `Deformation of the sheet: ${digits(frame.contact.depth_mm)} mm at ${digits(frame.contact.x_mm, 1)}, ${digits(frame.contact.y_mm, 1)} mm`
    : "Deformation of the sheet: no contact");
}

/** Legend, scale of the arrows, and what paleness means. */
function drawKey(context, width, height, shape, deviations) {
  const y = height - 32, s = sheet.scale, length = Math.min(320, width * 0.5);
  legend(context, "diverging", 8, y, length, [`−${short(s)}`, `0`, `+${short(s)} mm`], "Δz");
  let x = length + 32;
  if (sheet.arrow) {
    const bar = s / 2 * sheet.arrow;
    context.strokeStyle = context.fillStyle = theme.arrow;
    arrow(context, x, y + 5, x + bar, y + 5);
    write(context, `${short(s / 2)} mm`, x, y + 19, { align: "left" });
    if (width > 560) write(context, "shear: the way it moved", x + bar + 8, y + 5, { align: "left" });
    x += bar + (width > 560 ? 160 : 40);
  }
  if (deviations && x + 90 < width) {
    hatch(context, x, y - 1, 26, 12);
    context.strokeStyle = theme.line;
    context.strokeRect(x + 0.5, y - 0.5, 25, 11);
    write(context, width > 560 ? "uncertain (σ)" : "σ", x + 33, y + 5, { align: "left" });
  }
}

function arrow(context, x, y, toX, toY) {
  const length = Math.hypot(toX - x, toY - y);
  if (length < 1.5) return;
  const [ux, uy] = [(toX - x) / length, (toY - y) / length], head = Math.min(6, length * 0.5);
  context.lineWidth = 1.4;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(toX - ux * head * 0.7, toY - uy * head * 0.7);
  context.stroke();
  context.beginPath();
  context.moveTo(toX, toY);
  context.lineTo(toX - ux * head - uy * head * 0.45, toY - uy * head + ux * head * 0.45);
  context.lineTo(toX - ux * head + uy * head * 0.45, toY - uy * head - ux * head * 0.45);
  context.fill();
}

/** Steps of 1, 2 or 5 that divide a length into about five. */
function niceStep(length) {
  const size = 10 ** Math.floor(Math.log10(length / 5));
  return [1, 2, 5, 10].map((factor) => factor * size).find((step) => length / step <= 6);
}

function drawFlat(context, box, layout, shape, frame, values, deviations, isDecoded) {
  const [left, right, top, bottom] = [38, 12, 20, 34];
  const lengths = [shape.high[0] - shape.low[0], shape.high[1] - shape.low[1]];
  const unit = Math.min((box.width - left - right) / lengths[0], (box.height - top - bottom) / lengths[1]);
  const originX = box.x + left + Math.max(0, (box.width - left - right - unit * lengths[0]) / 2);
  const originY = box.y + top + unit * lengths[1];
  const toX = (x) => originX + (x - shape.low[0]) * unit, toY = (y) => originY - (y - shape.low[1]) * unit;
  const [cellX, cellY] = shape.step.map((step) => step * unit);
  if (deviations) hatch(context, toX(shape.low[0]), toY(shape.high[1]), unit * lengths[0], unit * lengths[1]);

  // Arrows are as long at half the scale as a cell is narrow.
  const smallest = Math.min(cellX, cellY);
  sheet.arrow = layout.electrodes.some((e) => e.outputs[0] !== null || e.outputs[1] !== null) ? smallest / sheet.scale * 1.7 : 0;
  layout.electrodes.forEach((electrode, index) => {
    const [, , dz] = axesOf(electrode, values), sigma = axesOf(electrode, deviations)[2];
    const [x, y] = [toX(shape.places[index][0]), toY(shape.places[index][1])];
    const colour = dz === null ? null : shade("diverging", zShare(dz)), alpha = opacity(sigma);
    context.fillStyle = colour ? css(colour, alpha) : theme.grid;
    if (shape.at) context.fillRect(x - cellX / 2 + 0.5, y - cellY / 2 + 0.5, cellX - 1, cellY - 1);
    else {
      context.beginPath();
      context.arc(x, y, smallest / 2, 0, 7);
      context.fill();
    }
    if (isDecoded) sheet.spots.push({ x, y, reach: Math.max(cellX, cellY) / 2 + 2, index });
    if (sheet.hasNumbers && dz !== null) {
      const size = Math.max(7.5, Math.min(12, cellX / 3.6));
      write(context, digits(dz), x, y + (sheet.arrow ? cellY * 0.3 : 0), { size, colour: alpha > 0.5 ? inkOn(colour) : theme.text });
    }
  });
  layout.electrodes.forEach((electrode, index) => {
    const [dx, dy, dz] = axesOf(electrode, values);
    const [x, y] = [toX(shape.places[index][0]), toY(shape.places[index][1])];
    context.strokeStyle = context.fillStyle = dz === null ? theme.arrow : inkOn(shade("diverging", zShare(dz)));
    // An electrode moves against Δ.
    arrow(context, x, y, x - (dx ?? 0) * sheet.arrow, y + (dy ?? 0) * sheet.arrow);
  });

  context.strokeStyle = theme.line;
  context.lineWidth = 1;
  context.strokeRect(toX(shape.low[0]), toY(shape.high[1]), unit * lengths[0], unit * lengths[1]);
  const step = niceStep(Math.max(...lengths)), [lowX, lowY] = shape.low.map((low) => Math.ceil(low / step - 1e-6) * step);
  for (let x = lowX; x <= shape.high[0] + 1e-6; x += step) write(context, `${+x.toFixed(6)}`, toX(x), originY + 11);
  for (let y = lowY; y <= shape.high[1] + 1e-6; y += step) write(context, `${+y.toFixed(6)}`, toX(shape.low[0]) - 7, toY(y), { align: "right" });
  write(context, "x, mm", toX(shape.high[0]), originY + 25, { align: "right" });
  write(context, "y, mm", toX(shape.low[0]) - 7, box.y + 8, { align: "right" });
  if (isDecoded && frame?.contact) {
    const { x_mm, y_mm } = frame.contact;
    context.strokeStyle = theme.arrow;
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(toX(x_mm), toY(y_mm), 9, 0, 7);
    for (const [ux, uy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(toX(x_mm) + 6 * ux, toY(y_mm) + 6 * uy);
      context.lineTo(toX(x_mm) + 13 * ux, toY(y_mm) + 13 * uy);
    }
    context.stroke();
  }
}

function drawSolid(context, box, layout, shape, frame, values, deviations, isDecoded) {
  const lengths = [shape.high[0] - shape.low[0], shape.high[1] - shape.low[1]];
  const middle = [0, 1].map((axis) => (shape.low[axis] + shape.high[axis]) / 2);
  // Δz at the end of the scale is drawn a third as deep as the face is wide: a real millimetre would hardly be seen.
  const boost = Math.max(...lengths) / 3 / sheet.scale;
  const depth = Math.max(...lengths) / 3;
  const unit = 0.92 * Math.min((box.width - 30) / Math.hypot(...lengths), (box.height - 30) / (Math.hypot(...lengths) * 0.62 + depth * 1.1));
  const [sinYaw, cosYaw] = [Math.sin(sheet.turn.yaw), Math.cos(sheet.turn.yaw)];
  const [sinPitch, cosPitch] = [Math.sin(sheet.turn.pitch), Math.cos(sheet.turn.pitch)];
  /** Point on the canvas and distance from the eye of a place in mm, z counted from the unloaded face and exaggerated. */
  const project = ([x, y, z]) => {
    const [u, v] = [x - middle[0], y - middle[1]];
    const [across, along] = [u * cosYaw - v * sinYaw, u * sinYaw + v * cosYaw];
    return [box.x + box.width / 2 + across * unit, box.y + box.height / 2 - (along * sinPitch + (z + depth / 2) * cosPitch) * unit,
      along * cosPitch - z * sinPitch];
  };
  const corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([i, j]) => [[shape.low, shape.high][i][0], [shape.low, shape.high][j][1]]);
  const outline = (z, colour) => {
    context.strokeStyle = colour;
    context.lineWidth = 1;
    context.beginPath();
    corners.forEach(([x, y], index) => context[index ? "lineTo" : "moveTo"](...project([x, y, z])));
    context.closePath();
    context.stroke();
  };
  outline(-depth, theme.line);
  context.strokeStyle = theme.line;
  context.beginPath();
  for (const [x, y] of corners) {
    context.moveTo(...project([x, y, 0]));
    context.lineTo(...project([x, y, -depth]));
  }
  context.stroke();

  const moved = layout.electrodes.map((electrode, index) => {
    const [dx, dy, dz] = axesOf(electrode, values).map((value) => value ?? 0), [x, y] = shape.places[index];
    const sigma = axesOf(electrode, deviations)[2];
    // Shear is drawn larger too, as long as a cell at the end of the scale.
    const stretch = Math.min(...shape.step) / sheet.scale;
    return { at: [x - dx * stretch, y - dy * stretch, -dz * boost], dz, alpha: opacity(sigma), place: [x, y, 0] };
  });
  sheet.arrow = 0;
  if (shape.at && shape.at.length > 1 && shape.at[0].length > 1) drawSurface(context, shape, moved, project);
  const points = moved.map((electrode) => project(electrode.at));
  moved.forEach(({ dz, place, alpha }, index) => {
    const [x, y] = points[index];
    if (!shape.at) {
      context.strokeStyle = theme.quiet;
      context.beginPath();
      context.moveTo(...project(place));
      context.lineTo(x, y);
      context.stroke();
    }
    context.fillStyle = shape.at ? theme.arrow : css(shade("diverging", zShare(dz)), alpha);
    context.beginPath();
    context.arc(x, y, shape.at ? 1.6 : 5, 0, 7);
    context.fill();
    if (sheet.hasNumbers) write(context, digits(dz), x, y - 8, { size: 9.5, colour: theme.text });
    if (isDecoded) sheet.spots.push({ x, y, reach: 18, index });
  });
  outline(0, theme.quiet);
  const [zero, end] = [project([...corners[0], 0]), project([...corners[0], -depth])];
  write(context, "0", zero[0] - 8, zero[1], { align: "right" });
  write(context, `Δz ${short(sheet.scale)} mm`, end[0] - 8, end[1], { align: "right" });
  const label = (text, place) => write(context, text, ...project(place).slice(0, 2));
  label("x", [shape.high[0] + lengths[0] * 0.05, shape.low[1], -depth]);
  label("y", [shape.low[0], shape.high[1] + lengths[1] * 0.05, -depth]);
}

/** The face between the electrodes, each mesh divided finely, the farthest first. */
function drawSurface(context, shape, moved, project) {
  const fine = 4, rows = shape.at.length, columns = shape.at[0].length;
  const mix = (i, j, pick) => {
    const [row, column] = [Math.min(Math.floor(i), rows - 2), Math.min(Math.floor(j), columns - 2)];
    const [v, u] = [i - row, j - column], corner = (a, b) => pick(moved[shape.at[row + a][column + b]]);
    return (1 - v) * ((1 - u) * corner(0, 0) + u * corner(0, 1)) + v * ((1 - u) * corner(1, 0) + u * corner(1, 1));
  };
  const grid = [];
  for (let i = 0; i <= (rows - 1) * fine; i++) {
    grid.push([]);
    for (let j = 0; j <= (columns - 1) * fine; j++) {
      const at = [0, 1, 2].map((axis) => mix(i / fine, j / fine, (electrode) => electrode.at[axis]));
      grid[i].push({ point: project(at), dz: mix(i / fine, j / fine, (e) => e.dz), alpha: mix(i / fine, j / fine, (e) => e.alpha) });
    }
  }
  const faces = [];
  for (let i = 0; i + 1 < grid.length; i++) {
    for (let j = 0; j + 1 < grid[0].length; j++) {
      const of = [grid[i][j], grid[i][j + 1], grid[i + 1][j + 1], grid[i + 1][j]];
      faces.push({ of, far: of.reduce((sum, corner) => sum + corner.point[2], 0), slope: of[0].dz - of[2].dz });
    }
  }
  faces.sort((a, b) => b.far - a.far);
  for (const { of, slope } of faces) {
    const [dz, alpha] = [of.reduce((sum, c) => sum + c.dz, 0) / 4, of.reduce((sum, c) => sum + c.alpha, 0) / 4];
    // A little light from the side, so that a slope is seen.
    const light = 1 + Math.max(-0.18, Math.min(0.18, slope / sheet.scale));
    const fill = css(shade("diverging", zShare(dz)).map((value) => Math.min(255, Math.round(value * light))), alpha);
    context.fillStyle = context.strokeStyle = fill;
    context.lineWidth = 0.6;
    context.beginPath();
    of.forEach(({ point }, index) => context[index ? "lineTo" : "moveTo"](point[0], point[1]));
    context.closePath();
    context.fill();
    if (alpha > 0.9) context.stroke();
  }
  context.strokeStyle = theme.hatch;
  context.lineWidth = 0.7;
  context.beginPath();
  const line = (points) => points.forEach(({ point }, index) => context[index ? "lineTo" : "moveTo"](point[0], point[1]));
  for (let i = 0; i < grid.length; i += fine) line(grid[i]);
  for (let j = 0; j < grid[0].length; j += fine) line(grid.map((row) => row[j]));
  context.stroke();
}

/** What is known of the electrode at a point of the canvas, in words. */
function sheetWords(layout, frame, x, y) {
  let [best, distance] = [null, Infinity];
  for (const spot of sheet.spots) {
    const away = Math.hypot(spot.x - x, spot.y - y);
    if (away < distance && away < spot.reach * 1.5) [best, distance] = [spot, away];
  }
  if (!best || !frame) return null;
  const electrode = layout.electrodes[best.index];
  const [values, deviations, truth] = [frame.outputs, frame.deviations, frame.truth].map((of) => axesOf(electrode, of));
  const lines = ["Δx", "Δy", "Δz"].map((axis, index) => electrode.outputs[index] === null ? null
    : `${axis} ${digits(values[index], 3)}${deviations[index] === null ? "" : ` ± ${digits(deviations[index], 3)}`} mm`
      + (truth[index] === null ? "" : `, true ${digits(truth[index], 3)}`));
  const place = electrode.place_mm.map((value) => digits(value, 1)).join(", ");
  return [electrode.name, `at ${place} mm`, ...lines.filter(Boolean)].join("\n");
}
