// The readings: a cell each, in rows and columns of wires.

/** Least change at the ends of the scale: as large for all sources, so that their pictures compare. */
const LEAST_CHANGE = 0.05;
const matrix = { isRelative: false, low: Infinity, high: -Infinity, most: LEAST_CHANGE, boxes: null };

/** Forgets the scales: they begin with the baseline again, and grow with what is seen. */
function resetMatrix() {
  Object.assign(matrix, { low: Infinity, high: -Infinity, most: LEAST_CHANGE });
  for (const value of baseline ?? []) widen(value);
  // Room for a press that lowers every reading.
  const span = matrix.high - matrix.low;
  if (span >= 0) Object.assign(matrix, { low: matrix.low - 0.2 * span, high: matrix.high + 0.1 * span });
}

function widen(value) {
  if (value === null) return;
  matrix.low = Math.min(matrix.low, value);
  matrix.high = Math.max(matrix.high, value);
}

/** Least 1, 2 or 5 times a power of ten that is not below a value. */
function roundUp(value) {
  const size = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((factor) => factor * size).find((round) => round >= value * 0.9999) ?? value;
}

/** Change of a reading against its baseline, as a share of it. */
function relative(frame, index) {
  const [now, rest] = [frame.readings[index], baseline?.[index]];
  return Number.isFinite(now) && rest ? now / rest - 1 : null;
}

/** Rows and columns; readings of no matrix fill lines of twelve at most. */
function sizeOf(layout) {
  const count = layout.readings.length;
  if (layout.rows * layout.columns === count && count > 0) return [layout.rows, layout.columns, true];
  const columns = Math.min(12, Math.ceil(Math.sqrt(count * 2)) || 1);
  return [Math.ceil(count / columns), columns, false];
}

function drawMatrix(canvas, layout, frame, wires) {
  const [rows, columns, isMatrix] = sizeOf(layout), width = canvas.clientWidth;
  const [left, top] = isMatrix ? [26, 18] : [0, 0];
  const cell = (width - left) / columns, tall = Math.max(13, Math.min(cell * 0.95, 30));
  const context = prepare(canvas, top + tall * rows + 40);
  const isRelative = matrix.isRelative && !!baseline;
  frame?.readings.forEach((value, index) => {
    const change = relative(frame, index);
    // A reading that trebled is of a broken wire, which would leave no colours for the others.
    if (Math.abs(change) > 2) return;
    widen(value);
    if (change !== null) matrix.most = Math.max(matrix.most, roundUp(Math.abs(change)));
  });
  // Round ends, which noise does not move.
  const step = roundUp((matrix.high - matrix.low) / 4 || 1), low = Math.floor(matrix.low / step) * step;
  const high = Math.ceil(matrix.high / step) * step, span = high - low || 1;
  // As in the sheet and on the pages of reports: the first row is the lowest.
  const topOf = (row) => top + (isMatrix ? rows - 1 - row : row) * tall;
  matrix.boxes = { left, top, cell, tall, rows, columns, isMatrix };
  for (let index = 0; index < layout.readings.length; index++) {
    const [x, y] = [left + (index % columns) * cell, topOf(Math.floor(index / columns))];
    const value = !frame ? null : isRelative ? relative(frame, index) : frame.readings[index] ?? null;
    if (value === null) {
      box(context, theme.hatched, x + 0.5, y + 0.5, cell - 1, tall - 1);
      continue;
    }
    const colour = shade(isRelative, isRelative ? 0.5 + value / matrix.most / 2 : (value - low) / span);
    box(context, colour.css, x + 0.5, y + 0.5, cell - 1, tall - 1);
    if (sheet.hasNumbers && cell > 19) {
      const text = isRelative ? digits(value * 100, Math.abs(value) < 0.0995 && cell > 24 ? 1 : 0) : short(value);
      write(context, text, x + cell / 2, y + tall / 2, { size: Math.min(11, cell / 2.9), colour: colour.ink });
    } else if (!isMatrix && cell > 54) {
      write(context, layout.readings[index].name.slice(0, cell / 7), x + cell / 2, y + tall / 2, { size: 11, colour: colour.ink });
    }
  }
  if (isMatrix) {
    const ailing = new Set(wires.map((wire) => wire.wire));
    const label = (kind, at, x, y) => {
      const is = ailing.has(`${kind} ${at}`);
      write(context, `${at}`, x, y, { colour: is ? theme.bad : theme.quiet, weight: is ? 700 : 400 });
      if (is) {
        context.strokeStyle = theme.bad;
        context.lineWidth = 1.5;
        if (kind === "row") context.strokeRect(left, y - tall / 2, width - left - 0.75, tall);
        else context.strokeRect(x - cell / 2, top, cell, tall * rows);
      }
    };
    const every = cell < 16 ? 2 : 1;
    for (let column = 1; column <= columns; column++) {
      if ((column - 1) % every === 0 || ailing.has(`column ${column}`)) label("column", column, left + (column - 0.5) * cell, 8);
    }
    for (let row = 1; row <= rows; row++) label("row", row, 12, topOf(row - 1) + tall / 2);
  }
  const unit = layout.readings[0]?.unit ?? "";
  const ticks = isRelative
    ? [-matrix.most, 0, matrix.most].map((value) => `${digits(value * 100, matrix.most < 0.05 ? 1 : 0)} %`)
    : isFinite(low) ? [low, (low + high) / 2, high].map((value, index) => short(value) + (index === 2 ? ` ${unit}` : "")) : [];
  legend(context, isRelative, left, top + tall * rows + 10, Math.min(340, width - left), ticks, isRelative ? relativeName(layout) : absoluteName(layout));
}

const isOhm = (layout) => ["Ω", "ohm", "kΩ"].includes(layout.readings[0]?.unit);
const relativeName = (layout) => isOhm(layout) ? "ΔR/R₀" : "change";
const absoluteName = (layout) => isOhm(layout) ? "R" : "value";

/** What is known of the reading at a point of the canvas, in words. */
function matrixWords(layout, frame, wires, x, y) {
  const boxes = matrix.boxes;
  if (!boxes || !frame) return null;
  const column = Math.floor((x - boxes.left) / boxes.cell), down = Math.floor((y - boxes.top) / boxes.tall);
  const row = boxes.isMatrix ? boxes.rows - 1 - down : down;
  const index = row * boxes.columns + column;
  if (column < 0 || row < 0 || column >= boxes.columns || row >= boxes.rows || index >= layout.readings.length) return null;
  const { name, unit } = layout.readings[index], value = frame.readings[index] ?? null;
  const lines = [name, value === null ? "missing" : `${short(value)} ${unit}`];
  if (boxes.isMatrix) lines.splice(1, 0, `row ${row + 1}, column ${column + 1}`);
  const change = relative(frame, index);
  if (change !== null) lines.push(`${relativeName(layout)} ${digits(change * 100)} % of ${short(baseline[index])} ${unit}`);
  const status = boxes.isMatrix ? frame.row_status?.[row] : null;
  if (status) lines.push(`row ${row + 1}: ${status}`);
  for (const { wire, health } of wires) {
    if (boxes.isMatrix && (wire === `row ${row + 1}` || wire === `column ${column + 1}`)) lines.push(`${wire} is ${health}`);
  }
  return lines.join("\n");
}
