// The sheet: deformation of the electrodes, flat or in three dimensions.

const START_TURN = { yaw: -0.5, pitch: 0.75 };
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
    // Scattered: as if they filled the face evenly.
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
  const panels = [["decoded", frame?.outputs ?? [], frame?.deviations ?? null], ["truth", frame?.truth, null]]
    .filter(([, values], index) => values?.length || !index && !frame?.truth);
  const width = canvas.clientWidth, across = panels.length > 1 && width > 560 ? 2 : 1;
  const down = panels.length / across, panelWidth = width / across;
  const ratio = (shape.high[1] - shape.low[1]) / (shape.high[0] - shape.low[0]);
  const limit = Math.max(300, innerHeight - 330) / down;
  const panelHeight = Math.max(180, Math.min((panelWidth - 60) * (sheet.is3d ? 0.85 : ratio) + 54, limit));
  const height = panelHeight * down + 44;
  const context = prepare(canvas, height);
  sheet.spots = [];
  panels.forEach(([title, values, deviations], index) => {
    const area = { x: (index % across) * panelWidth, y: Math.floor(index / across) * panelHeight, width: panelWidth, height: panelHeight };
    if (frame?.truth) write(context, title, area.x + panelWidth / 2, area.y + 8, { colour: theme.text, weight: 600, size: 12.5 });
    (sheet.is3d ? drawSolid : drawFlat)(context, area, layout, shape, frame, values, deviations, index === 0);
  });
  drawKey(context, width, height, shape, frame?.deviations);
}

/** Legend, scale of the arrows, and what paleness means. */
function drawKey(context, width, height, shape, deviations) {
  const y = height - 32, s = sheet.scale, length = Math.min(320, width * 0.5);
  legend(context, true, 8, y, length, [`−${plain(s)}`, "0", `+${plain(s)} mm`], "Δz");
  let x = length + 32;
  if (sheet.arrow) {
    const bar = s / 2 * sheet.arrow;
    context.strokeStyle = context.fillStyle = theme.text;
    arrow(context, x, y + 5, x + bar, y + 5);
    write(context, `${plain(s / 2)} mm`, x, y + 19, { align: "left" });
    if (width > 560) write(context, "shear: direction moved", x + bar + 8, y + 5, { align: "left" });
    x += bar + (width > 560 ? 160 : 40);
  }
  if (deviations && x + 90 < width) {
    box(context, theme.hatched, x, y - 1, 26, 12);
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
  line(context, [[x, y], [toX - ux * head * 0.7, toY - uy * head * 0.7]]);
  context.stroke();
  const [backX, backY, side] = [toX - ux * head, toY - uy * head, head * 0.45];
  context.beginPath();
  line(context, [[toX, toY], [backX - uy * side, backY + ux * side], [backX + uy * side, backY - ux * side]]);
  context.fill();
}

function drawFlat(context, area, layout, shape, frame, values, deviations, isDecoded) {
  const [left, right, top, bottom] = [38, 12, 20, 34];
  const lengths = [shape.high[0] - shape.low[0], shape.high[1] - shape.low[1]];
  const unit = Math.min((area.width - left - right) / lengths[0], (area.height - top - bottom) / lengths[1]);
  const originX = area.x + left + Math.max(0, (area.width - left - right - unit * lengths[0]) / 2);
  const originY = area.y + top + unit * lengths[1];
  const toX = (x) => originX + (x - shape.low[0]) * unit, toY = (y) => originY - (y - shape.low[1]) * unit;
  const at = (index) => [toX(shape.places[index][0]), toY(shape.places[index][1])];
  const [cellX, cellY] = shape.step.map((step) => step * unit);

  // Arrows are as long at half the scale as a cell is narrow.
  const smallest = Math.min(cellX, cellY);
  sheet.arrow = layout.electrodes.some((e) => e.outputs[0] !== null || e.outputs[1] !== null) ? smallest / sheet.scale * 1.7 : 0;
  layout.electrodes.forEach((electrode, index) => {
    const [, , dz] = axesOf(electrode, values), sigma = axesOf(electrode, deviations)[2];
    const [x, y] = at(index);
    const colour = dz === null ? { css: theme.grid } : shade(true, zShare(dz)), alpha = opacity(sigma);
    // Through what is uncertain, the hatched ground shows.
    for (const [fill, strength] of alpha < 0.9 ? [[theme.hatched, 1], [colour.css, alpha]] : [[colour.css, alpha]]) {
      context.globalAlpha = strength;
      context.fillStyle = fill;
      context.beginPath();
      if (shape.at) context.rect(x - cellX / 2 + 0.5, y - cellY / 2 + 0.5, cellX - 1, cellY - 1);
      else context.arc(x, y, smallest / 2, 0, 7);
      context.fill();
    }
    context.globalAlpha = 1;
    if (isDecoded) sheet.spots.push({ x, y, reach: Math.max(cellX, cellY) / 2 + 2, index });
    if (sheet.hasNumbers && dz !== null) {
      const size = Math.max(7.5, Math.min(12, cellX / 3.6));
      write(context, digits(dz), x, y + (sheet.arrow ? cellY * 0.3 : 0), { size, colour: alpha > 0.5 ? colour.ink : theme.text });
    }
  });
  layout.electrodes.forEach((electrode, index) => {
    const [dx, dy, dz] = axesOf(electrode, values);
    const x = at(index)[0], y = at(index)[1] - (sheet.hasNumbers ? cellY * 0.14 : 0);
    const alpha = opacity(axesOf(electrode, deviations)[0]);
    context.globalAlpha = Math.max(0.3, alpha);
    context.strokeStyle = context.fillStyle = dz === null || alpha < 0.5 ? theme.text : shade(true, zShare(dz)).ink;
    // An electrode moves against Δ.
    arrow(context, x, y, x - (dx ?? 0) * sheet.arrow, y + (dy ?? 0) * sheet.arrow);
  });
  context.globalAlpha = 1;

  context.strokeStyle = theme.line;
  context.lineWidth = 1;
  context.strokeRect(toX(shape.low[0]), toY(shape.high[1]), unit * lengths[0], unit * lengths[1]);
  const step = roundUp(Math.max(...lengths) / 6), [lowX, lowY] = shape.low.map((low) => Math.ceil(low / step - 1e-6) * step);
  for (let x = lowX; x <= shape.high[0] + 1e-6; x += step) write(context, `${+x.toFixed(6)}`, toX(x), originY + 11);
  for (let y = lowY; y <= shape.high[1] + 1e-6; y += step) write(context, `${+y.toFixed(6)}`, toX(shape.low[0]) - 7, toY(y), { align: "right" });
  write(context, "x, mm", toX(shape.high[0]), originY + 25, { align: "right" });
  write(context, "y, mm", toX(shape.low[0]) - 3, area.y + 8, { align: "right" });
  // It would cover the numbers.
  if (isDecoded && frame?.contact && !sheet.hasNumbers) {
    const { x_mm, y_mm } = frame.contact;
    context.strokeStyle = theme.text;
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(toX(x_mm), toY(y_mm), 9, 0, 7);
    for (const [ux, uy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      line(context, [6, 13].map((reach) => [toX(x_mm) + reach * ux, toY(y_mm) + reach * uy]));
    }
    context.stroke();
  }
}

function drawSolid(context, area, layout, shape, frame, values, deviations, isDecoded) {
  const lengths = [shape.high[0] - shape.low[0], shape.high[1] - shape.low[1]];
  const middle = [0, 1].map((axis) => (shape.low[axis] + shape.high[axis]) / 2);
  // Δz at the end of the scale is drawn a third as deep as the face is wide: a real millimetre would hardly be seen.
  const boost = Math.max(...lengths) / 3 / sheet.scale;
  const depth = Math.max(...lengths) / 3;
  const unit = 0.92 * Math.min((area.width - 30) / Math.hypot(...lengths), (area.height - 30) / (Math.hypot(...lengths) * 0.62 + depth * 1.1));
  const [sinYaw, cosYaw] = [Math.sin(sheet.turn.yaw), Math.cos(sheet.turn.yaw)];
  const [sinPitch, cosPitch] = [Math.sin(sheet.turn.pitch), Math.cos(sheet.turn.pitch)];
  /** Point on the canvas and distance from the eye of a place in mm, z counted from the unloaded face and exaggerated. */
  const project = ([x, y, z]) => {
    const [u, v] = [x - middle[0], y - middle[1]];
    const [across, along] = [u * cosYaw - v * sinYaw, u * sinYaw + v * cosYaw];
    return [area.x + area.width / 2 + across * unit, area.y + area.height / 2 - (along * sinPitch + (z + depth / 2) * cosPitch) * unit,
      along * cosPitch - z * sinPitch];
  };
  const ends = [shape.low, shape.high];
  const corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]].map(([i, j]) => [ends[i][0], ends[j][1]]);
  context.strokeStyle = theme.line;
  context.lineWidth = 1;
  context.beginPath();
  for (const z of [0, -depth]) line(context, corners.map(([x, y]) => project([x, y, z])));
  for (const [x, y] of corners) line(context, [project([x, y, 0]), project([x, y, -depth])]);
  context.stroke();

  // Shear is drawn larger too: as long as a cell at the end of the scale.
  const stretch = Math.min(...shape.step) / sheet.scale;
  sheet.arrow = stretch * unit;
  /** Of each electrode: where it is drawn, Δz in mm, and how certain it is. */
  const moved = layout.electrodes.map((electrode, index) => {
    const [dx, dy, dz] = axesOf(electrode, values), [x, y] = shape.places[index];
    return [x - dx * stretch, y - dy * stretch, -dz * boost, dz ?? 0, opacity(axesOf(electrode, deviations)[2])];
  });
  if (shape.at?.length > 1 && shape.at[0].length > 1) drawSurface(context, shape, moved, project);
  moved.forEach(([toX, toY, z, dz, alpha], index) => {
    const [x, y] = project([toX, toY, z]), [fromX, fromY] = shape.places[index];
    context.strokeStyle = context.fillStyle = shape.at ? theme.text : theme.quiet;
    arrow(context, ...project([fromX, fromY, z]).slice(0, 2), x, y);
    context.beginPath();
    if (!shape.at) {
      line(context, [project([fromX, fromY, 0]), [x, y]]);
      context.stroke();
      context.beginPath();
      context.fillStyle = shade(true, zShare(dz)).css;
      context.globalAlpha = alpha;
    }
    context.arc(x, y, shape.at ? 1.3 : 5, 0, 7);
    context.fill();
    context.globalAlpha = 1;
    if (sheet.hasNumbers) write(context, digits(dz), x, y - 8, { size: 9.5, colour: theme.text });
    if (isDecoded) sheet.spots.push({ x, y, reach: 18, index });
  });
  const label = (text, place) => write(context, text, ...project(place).slice(0, 2));
  label("0", [shape.low[0] - lengths[0] * 0.04, shape.low[1], 0]);
  label(`${plain(sheet.scale)} mm`, [shape.low[0] - lengths[0] * 0.1, shape.low[1], -depth]);
  label("x", [middle[0], shape.low[1] - lengths[1] * 0.06, -depth]);
  label("y", [shape.high[0] + lengths[0] * 0.06, middle[1], -depth]);
}

/** The face between the electrodes, each mesh divided finely, the farthest first. */
function drawSurface(context, shape, moved, project) {
  const fine = 3, rows = (shape.at.length - 1) * fine, columns = (shape.at[0].length - 1) * fine;
  const grid = [], faces = [];
  for (let i = 0; i <= rows; i++) {
    grid.push([]);
    for (let j = 0; j <= columns; j++) {
      const row = Math.floor(Math.min(i, rows - 1) / fine), column = Math.floor(Math.min(j, columns - 1) / fine);
      const [v, u] = [i / fine - row, j / fine - column];
      const [a, b, c, d] = [[0, 0], [0, 1], [1, 0], [1, 1]].map(([down, on]) => moved[shape.at[row + down][column + on]]);
      const mixed = a.map((_, k) => (1 - v) * ((1 - u) * a[k] + u * b[k]) + v * ((1 - u) * c[k] + u * d[k]));
      grid[i].push({ point: project(mixed), dz: mixed[3], alpha: mixed[4] });
      if (!i || !j) continue;
      const of = [grid[i - 1][j - 1], grid[i - 1][j], grid[i][j], grid[i][j - 1]];
      faces.push({ of, far: of[0].point[2] + of[2].point[2], dz: (of[0].dz + of[2].dz) / 2, alpha: (of[0].alpha + of[2].alpha) / 2 });
    }
  }
  faces.sort((a, b) => b.far - a.far);
  context.lineWidth = 0.7;
  for (const { of, dz, alpha } of faces) {
    context.fillStyle = context.strokeStyle = shade(true, zShare(dz)).css;
    context.globalAlpha = alpha;
    context.beginPath();
    line(context, of.map((corner) => corner.point));
    context.closePath();
    context.fill();
    // Closes the seams.
    if (alpha > 0.9) context.stroke();
  }
  context.globalAlpha = 1;
  context.strokeStyle = theme.hatch;
  context.beginPath();
  const along = (cells) => line(context, cells.map((cell) => cell.point));
  for (let i = 0; i <= rows; i += fine) along(grid[i]);
  for (let j = 0; j <= columns; j += fine) along(grid.map((row) => row[j]));
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
