// The page: what comes in, what is drawn when, and what buttons and keys do.

const byId = (id) => document.getElementById(id);
/** Address of a path, with the page's token. */
const address = (path, more = "") => path + location.search + more;
const MOST_CHARTS = 12;
const TOKEN = new URLSearchParams(location.search).get("token");
const GONE = `The program at ${location.host} does not answer. Start it again with --http-port ${location.port} --token ${TOKEN}, and this page reconnects.`;
/** Time in ms without an event after which the server is taken for gone. */
const SILENCE_MS = 3500;
/** Longest time in ms that events may be held up on their way. */
const MOST_DELAY_MS = 1500;

let layout = null, shape = null, baseline = null, frame = null, status = null;
/** Frame that is drawn, when it arrived, and its age then. */
let arrived = 0, arrivedAge = 0;
/** Pictures of the last two seconds: [time in ms, age in ms]. */
let drawn = [];
let contact = { trace: new Trace(2), chart: null, wasSeen: false, hasForce: false };
let values = { trace: new Trace(0), charts: [], numbers: [], outputs: [] };
/** Whether a frame had outputs: without any, their panels are not shown. */
let hasOutputs = false;

// ---- Events ----

let source = null, lastEvent = 0, tick = 0, retry = 0, rate = null, trouble = "connecting";
/** Least differences of the clocks in this half minute and the one before, and when it began. */
let clocks = { now: Infinity, before: Infinity, since: 0 };

function connect() {
  clearTimeout(retry);
  source?.close();
  source = null;
  // A tab that nobody sees leaves its connection to others.
  if (document.hidden) return;
  source = new EventSource(address("/events", rate ? `&rate=${rate}` : ""));
  lastEvent = performance.now();
  clocks = { now: Infinity, before: Infinity, since: lastEvent };
  const on = (name, take) => source.addEventListener(name, (event) => {
    lastEvent = performance.now();
    trouble = null;
    take(JSON.parse(event.data));
  });
  on("layout", takeLayout);
  on("baseline", (readings) => {
    const isFirst = !baseline;
    baseline = readings;
    resetMatrix();
    if (isFirst) setQuantity(true);
    requestDraw();
  });
  on("status", (next) => {
    if (JSON.stringify(next.wires) !== JSON.stringify(status?.wires)) showWires(next.wires);
    status = next;
    showStatus();
  });
  on("frame", takeFrame);
  source.onerror = () => lose();
}

/** The server is gone or refuses: says so, and tries again. */
async function lose() {
  source?.close();
  source = null;
  clearTimeout(retry);
  retry = setTimeout(connect, 1000);
  trouble ??= GONE;
  showBanner();
  const asked = new AbortController(), answer = await fetch(address("/events"), { signal: asked.signal }).catch(() => null);
  if (answer && !answer.ok) trouble = `Refused: ${await answer.text()}.`;
  asked.abort();
}

function takeLayout(next) {
  // After a reconnection all goes on as before.
  if (JSON.stringify(next) === JSON.stringify(layout)) return;
  [layout, frame, baseline] = [next, null, null];
  shape = layout.electrodes.length ? shapeOf(layout) : null;
  document.title = `${layout.title} – Taxel`;
  setText("title", layout.title);
  setText("source", `${capital(layout.kind)}: ${layout.source}`);
  // Outputs that belong to no electrode are values.
  const held = new Set(layout.electrodes.flatMap((electrode) => electrode.outputs));
  const others = layout.outputs.map((_, index) => index).filter((index) => !held.has(index));
  const { can, kind, readings } = layout, parts = {
    zero: can.zero, record: can.record, transport: can.seek, sheet_card: shape, values_card: others.length, error_card: kind === "simulation" && shape,
  };
  for (const [id, isThere] of Object.entries(parts)) byId(id).hidden = !isThere;
  byId("position").max = layout.duration_s ?? 1;
  setText("absolute", readings[0]?.unit || "value");
  setText("relative", relativeName(layout));
  contact = { trace: new Trace(2), chart: contact.chart, wasSeen: false, hasForce: false };
  hasOutputs = false;
  makeValues(others);
  showSize();
  resetSheet();
  resetMatrix();
  requestDraw();
}

function takeFrame(next) {
  const now = performance.now(), difference = now - next.sent_ms;
  if (now - clocks.since > 30000) clocks = { before: clocks.now, now: Infinity, since: now };
  clocks.now = Math.min(clocks.now, difference);
  const delay = difference - Math.min(clocks.now, clocks.before);
  if (delay > MOST_DELAY_MS) {
    // What waits on the way is old: begin anew, with fewer frames unless the page slept.
    if (now - tick < 1000) rate = Math.max(4, Math.round((rate ?? 60) / 2));
    return connect();
  }
  [frame, arrived, arrivedAge] = [next, now, next.age_ms + delay];
  for (const flag of frame.flags) flags.set(flag, now);
  if (frame.flags.includes("novel")) flags.set("nats", frame.novelty);
  const time = frame.time_us / 1e6, at = frame.contact;
  contact.wasSeen ||= !!at;
  hasOutputs ||= frame.outputs.length > 0;
  contact.hasForce ||= Number.isFinite(frame.force_n);
  contact.trace.push(time, [frame.force_n, at ? at.depth_mm : 0]);
  values.trace.push(time, values.outputs.slice(0, MOST_CHARTS).map((index) => frame.outputs[index]));
  requestDraw();
}

// ---- Words ----

/** When each flag was seen last: it is shown for a second at least, so that it can be read. */
const flags = new Map();
const FLAG_WORDS = {
  novel: () => `Unlike anything the model was trained on${Number.isFinite(flags.get("nats")) ? ` (by ${plain(flags.get("nats"))} nats)` : ""}: do not trust the picture`,
  clamped: () => "Out of range: readings outside the training range were clamped to its ends",
  missing: () => `${frame.readings.filter((value) => value === null).length} of ${frame.readings.length} readings are missing`,
};

function setText(id, text) {
  const element = byId(id);
  if (element.textContent !== `${text}`) element.textContent = text;
}

const capital = (words) => words.charAt(0).toUpperCase() + words.slice(1);
const press = (id, isPressed) => byId(id).setAttribute("aria-pressed", isPressed);

function showBanner() {
  let [level, words] = ["calm", status?.message || "All is well"];
  const seen = Object.keys(FLAG_WORDS).filter((flag) => frame && performance.now() - (flags.get(flag) ?? -Infinity) < 1000);
  if (trouble) [level, words] = [trouble === "connecting" ? "calm" : "bad", trouble];
  else if (status?.state === "no data") level = "bad";
  else if (seen.length) {
    const said = seen.map((flag) => FLAG_WORDS[flag]());
    if (status?.message) said.push(status.message);
    [level, words] = ["warn", `${said.map(capital).join(". ")}.`];
  } else if (status?.message && status.state === "live") level = "warn";
  setText("banner", capital(words));
  byId("banner").dataset.level = level;
  const state = trouble ? "gone" : status?.state ?? "live";
  setText("state", trouble ? trouble === "connecting" ? "connecting" : "no connection" : state === "live" && layout?.kind === "recording" ? "playing" : state);
  byId("state").dataset.state = state;
}

function bytes(count) {
  const power = Math.min(3, Math.floor(Math.log10(count || 1) / 3));
  return `${power ? (count / 1e3 ** power).toFixed(1) : count} ${["B", "kB", "MB", "GB"][power]}`;
}

function showStatus() {
  const { recording } = status, isPaused = ["paused", "ended"].includes(status.state);
  setText("scan_rate", digits(status.scan_rate, 0));
  setText("decode_rate", digits(status.decode_rate, 0));
  setText("lost", status.lost);
  setText("event", status.event ?? "");
  byId("lost").style.color = status.lost ? theme.warn : "";
  if (layout) showSize();
  if (!isPaused) {
    setText("rmse", digits(status.rmse_mm, 3));
    setText("times_limit", digits(status.times_limit));
  }
  press("pause", isPaused);
  byId("pause").firstElementChild.textContent = isPaused ? "Resume" : "Pause";
  press("record", !!recording);
  byId("record").firstElementChild.textContent = recording ? "Stop" : "Record";
  setText("recording", recording ? `${recording.file}: ${bytes(recording.bytes)}, ${recording.seconds.toFixed(1)} s` : "");
  if (status.position_s !== null && !seek.isHeld) showPosition(status.position_s);
  if (status.speed !== null && document.activeElement !== byId("speed")) {
    byId("speed").value = Math.log10(status.speed);
    setText("speed_words", `× ${plain(status.speed)}`);
  }
  showBanner();
}

function showSize() {
  const [rows, columns, isMatrix] = sizeOf(layout), rest = status?.rest;
  const size = isMatrix ? `${rows} rows × ${columns} columns` : `${layout.readings.length} readings`;
  setText("matrix_words", rest ? `${size}, rest: ${rest}` : size);
}

function showWires(wires) {
  byId("wires").replaceChildren(...wires.map(({ wire, health, words }) => {
    const item = document.createElement("li"), name = document.createElement("b");
    name.textContent = `${capital(wire)}: ${health}`;
    item.append(name, ` – ${words}`);
    return item;
  }));
  requestDraw();
}

function showPosition(position_s) {
  byId("position").value = position_s;
  setText("position_words", `${position_s.toFixed(2)} s`);
}

function showRates() {
  const now = tick = performance.now();
  if (source && now - lastEvent > SILENCE_MS) lose();
  drawn = drawn.filter(([time]) => now - time < 2000);
  const last = drawn.filter(([time]) => now - time < 1000);
  setText("shown_rate", last.length);
  const isWaiting = !frame || trouble || ["paused", "ended"].includes(status?.state);
  const age = last.length ? last.reduce((sum, [, age]) => sum + age, 0) / last.length : now - arrived + arrivedAge;
  setText("age", digits(isWaiting ? null : age, 0));
  showBanner();
}

// ---- Drawing: only when something new came ----

let isDrawing = false, slowAt = 0, slowTimer = 0;
function requestDraw() {
  if (isDrawing) return;
  isDrawing = true;
  requestAnimationFrame(draw);
}

let drawnFrame = null;
function draw() {
  isDrawing = false;
  if (!layout) return;
  const now = performance.now();
  if (shape) drawSheet(byId("sheet"), layout, shape, frame);
  // Twenty pictures a second are enough for the rest.
  clearTimeout(slowTimer);
  if (now - slowAt > 45) {
    slowAt = now;
    drawMatrix(byId("matrix"), layout, frame, status?.wires ?? []);
    if (frame) showNumbers();
    drawTraces();
  } else {
    slowTimer = setTimeout(requestDraw, 60);
  }
  showTip();
  if (frame && frame !== drawnFrame) {
    drawn.push([now, arrivedAge + performance.now() - arrived]);
    drawnFrame = frame;
  }
}

function showNumbers() {
  const at = frame.contact, { hasForce, trace } = contact;
  const isEmpty = !hasOutputs && !frame.truth;
  byId("sheet_card").hidden = !shape || isEmpty;
  byId("values_card").hidden = !values.outputs.length || isEmpty;
  byId("contact_card").hidden = !contact.wasSeen && !(shape && hasOutputs);
  byId("force_item").hidden = !hasForce;
  setText("force", digits(frame.force_n ?? 0));
  setText("depth", digits(at?.depth_mm ?? 0));
  setText("place", at ? `${digits(at.x_mm, 1)}, ${digits(at.y_mm, 1)}` : "–");
  const peak = trace.most(hasForce ? 1 : 2);
  setText("peak", digits(peak));
  setText("peak_unit", hasForce ? "N" : "mm");
  values.numbers.forEach((number, index) => {
    const [value, deviation] = [frame.outputs, frame.deviations].map((of) => of?.[values.outputs[index]]);
    const truth = frame.truth?.[values.outputs[index]];
    number.textContent = short(value) + (Number.isFinite(deviation) ? ` ± ${short(deviation)}` : "") + (Number.isFinite(truth) ? ` (true ${short(truth)})` : "");
  });
  if (!frame.truth) return;
  byId("error_card").hidden = !shape || !frame.outputs.length;
  const pairs = layout.electrodes.map(({ outputs }) => outputs[2]).filter((index) => index !== null);
  const sum = pairs.reduce((sum, index) => sum + (frame.outputs[index] - frame.truth[index]) ** 2, 0);
  setText("frame_rmse", digits(pairs.length ? Math.sqrt(sum / pairs.length) : null, 3));
}

function drawTraces() {
  if (!byId("contact_card").hidden) {
    const { hasForce } = contact, [times, ...both] = contact.trace.data(), shown = hasForce ? 0 : 1;
    if (contact.chart?.hasForce !== hasForce) {
      contact.chart?.destroy();
      contact.chart = chart(byId("contact_plot"), 150, [
        { scale: "force", unit: "N", colour: () => theme.force, fromZero: 1 },
        { scale: "depth", unit: "mm", colour: () => theme.depth, fromZero: 0.2 },
      ].slice(shown));
      contact.chart.hasForce = hasForce;
    }
    contact.chart.setData([times, ...both.slice(shown)]);
  }
  const [times, ...series] = values.trace.data();
  values.charts.forEach((plot, index) => plot.setData([times, series[index]]));
}

/** Name, value and trace of each of some outputs. */
function makeValues(outputs) {
  values.charts.forEach((plot) => plot.destroy());
  values = { trace: new Trace(Math.min(MOST_CHARTS, outputs.length)), charts: [], numbers: [], outputs };
  byId("values").replaceChildren();
  outputs.forEach((output, index) => {
    const { name, unit } = layout.outputs[output];
    const [card, line, title, value, number] = ["div", "p", "span", "span", "b"].map((tag) => document.createElement(tag));
    card.className = "value";
    title.textContent = name;
    number.textContent = "–";
    value.append(number, ` ${unit}`);
    line.append(title, value);
    card.append(line);
    byId("values").append(card);
    values.numbers.push(number);
    if (index < MOST_CHARTS) values.charts.push(chart(card, 100, [{ scale: "y", unit: "", colour: () => theme.force }]));
  });
}

function fit() {
  contact.chart?.setSize({ width: byId("contact_plot").clientWidth, height: 150 });
  values.charts.forEach((plot) => plot.setSize({ width: plot.root.parentElement.clientWidth, height: 100 }));
  slowAt = 0;
  requestDraw();
}

// ---- Pointer ----

let hover = null;
function showTip() {
  const tip = byId("tip");
  let words = null;
  if (hover && layout) {
    const box = hover.canvas.getBoundingClientRect(), [x, y] = [hover.x - box.left, hover.y - box.top];
    words = hover.canvas.id === "sheet" ? shape && sheetWords(layout, frame, x, y) : matrixWords(layout, frame, status?.wires ?? [], x, y);
  }
  tip.hidden = !words;
  if (!words) return;
  setText("tip", words);
  tip.style.left = `${Math.max(4, Math.min(hover.x + 14, innerWidth - tip.offsetWidth - 8))}px`;
  tip.style.top = `${Math.max(4, Math.min(hover.y + 14, innerHeight - tip.offsetHeight - 8))}px`;
}

for (const id of ["sheet", "matrix"]) {
  const canvas = byId(id);
  canvas.addEventListener("pointermove", (event) => {
    if (id === "sheet" && sheet.is3d && event.buttons) turn(event.movementX, event.movementY);
    hover = { canvas, x: event.clientX, y: event.clientY };
    requestDraw();
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointerleave", () => { hover = null; requestDraw(); });
}

function turn(across, down) {
  sheet.turn.yaw += across * 0.008;
  sheet.turn.pitch = Math.max(0.1, Math.min(1.5, sheet.turn.pitch + down * 0.008));
}

// ---- Buttons and keys ----

let answerTimer = 0;
function say(words, isBad) {
  clearTimeout(answerTimer);
  setText("answer", capital(words));
  byId("answer").dataset.level = isBad ? "bad" : "good";
  answerTimer = setTimeout(() => setText("answer", ""), isBad ? 8000 : 3000);
}

/** Asks the source for something, and shows its answer. */
async function ask(command, isQuiet) {
  try {
    const answer = await fetch(address("/command"), { method: "POST", body: JSON.stringify(command) });
    const text = await answer.text();
    if (answer.ok) return isQuiet || say(JSON.parse(text).message);
    say(answer.status === 409 ? JSON.parse(text).error : text, true);
  } catch {
    say("The program does not answer.", true);
  }
}

function resetSheet() {
  sheet.scale = layout?.scale_mm > 0 ? layout.scale_mm : 1;
  sheet.turn = { ...START_TURN };
  showScale();
}

function showScale() {
  setText("sheet_words", `Δz within ±${plain(sheet.scale)} mm${sheet.is3d ? ", exaggerated; drag to turn" : ""}`);
}

function toggle(id, name) {
  sheet[name] = !sheet[name];
  press(id, sheet[name]);
  showScale();
}

function setQuantity(isRelative) {
  if (isRelative && !baseline) return say("There is no baseline yet.", true);
  matrix.isRelative = isRelative;
  press("relative", isRelative);
  press("absolute", !isRelative);
}

function rescale(factor) {
  sheet.scale = Math.max(0.001, Math.min(1000, sheet.scale * factor));
  showScale();
}

const ACTIONS = {
  zero: () => layout?.can.zero ? ask({ action: "zero" }) : say("This source cannot be zeroed.", true),
  pause: () => ask({ action: ["paused", "ended"].includes(status?.state) ? "resume" : "pause" }),
  record: () => layout?.can.record ? ask({ action: status?.recording ? "stop_recording" : "record" }) : say("This source cannot be recorded.", true),
  screenshot: () => saveScreenshot(),
  numbers: () => toggle("numbers", "hasNumbers"),
  third: () => toggle("third", "is3d"),
  narrower: () => rescale(0.5),
  wider: () => rescale(2),
  reset: () => { resetSheet(); resetMatrix(); },
  absolute: () => setQuantity(false),
  relative: () => setQuantity(true),
  back: () => layout?.can.seek && ask({ action: "step", frames: -1 }, true),
  forth: () => layout?.can.seek && ask({ action: "step", frames: 1 }, true),
};
const KEYS = {
  b: "zero", " ": "pause", r: "record", s: "screenshot", n: "numbers", 3: "third", "-": "narrower", "+": "wider", "=": "wider",
  0: "reset", ",": "back", ".": "forth",
};

for (const [id, act] of Object.entries(ACTIONS)) {
  byId(id).addEventListener("click", (event) => {
    act();
    slowAt = 0;
    requestDraw();
    // After a click, space pauses again; who goes by keyboard stays on the button.
    if (event.detail) event.currentTarget.blur();
  });
}

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat && event.key === " ") return;
  if (event.target.id === "sheet" && sheet.is3d && event.key.startsWith("Arrow")) {
    const [across, down] = { ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12] }[event.key];
    turn(across, down);
  } else if (event.key === " " && event.target.closest("button")) {
    return;
  } else {
    const act = ACTIONS[KEYS[event.key.toLowerCase()]];
    if (!act) return;
    act();
  }
  slowAt = 0;
  event.preventDefault();
  requestDraw();
});

/** Place that the slider asks for: one request at a time, the newest wins. */
const seek = { isHeld: false, isAsking: false, wanted: null };
async function seekTo(to_s) {
  seek.wanted = to_s;
  if (seek.isAsking) return;
  seek.isAsking = true;
  while (seek.wanted !== null) {
    const now = seek.wanted;
    seek.wanted = null;
    await ask({ action: "seek", to_s: now }, true);
  }
  seek.isAsking = false;
}
byId("position").addEventListener("input", (event) => {
  seek.isHeld = true;
  showPosition(+event.target.value);
  seekTo(+event.target.value);
});
byId("position").addEventListener("change", () => { seek.isHeld = false; });
byId("speed").addEventListener("input", (event) => {
  const factor = +(10 ** event.target.value).toPrecision(2);
  setText("speed_words", `× ${factor}`);
  ask({ action: "speed", factor }, true);
});

/** Draws the page as it is seen, boxes, canvases and texts, and saves it. */
function saveScreenshot() {
  const ratio = devicePixelRatio || 1, body = document.body.getBoundingClientRect();
  const picture = document.createElement("canvas");
  [picture.width, picture.height] = [Math.round(body.width * ratio), Math.round(body.height * ratio)];
  const context = picture.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, -body.left * ratio, -body.top * ratio);
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(body.left, body.top, body.width, body.height);
  for (const element of document.querySelectorAll("#banner, .state, section, button, #wires li, canvas")) {
    const { left, top, width, height } = element.getBoundingClientRect(), style = getComputedStyle(element);
    if (!width) continue;
    context.fillStyle = style.backgroundColor;
    context.strokeStyle = style.borderTopColor;
    context.beginPath();
    context.roundRect(left + 0.5, top + 0.5, width - 1, height - 1, Math.min(parseFloat(style.borderRadius) || 0, height / 2));
    context.fill();
    if (parseFloat(style.borderTopWidth)) context.stroke();
    if (element.getContext) context.drawImage(element, left, top, width, height);
  }
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), range = document.createRange();
  for (let node; (node = texts.nextNode());) {
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect(), style = getComputedStyle(node.parentElement);
    if (!box.width || !node.data.trim() || node.parentElement.id === "tip") continue;
    context.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
    [context.fillStyle, context.textAlign, context.textBaseline] = [style.color, "left", "middle"];
    context.fillText(node.data.replace(/\s+/g, " "), box.left, box.top + box.height / 2, box.width + 2);
  }
  picture.toBlob((blob) => {
    const link = document.createElement("a"), name = (layout?.title ?? "view").replace(/[^\w-]+/g, "-").slice(0, 40);
    link.href = URL.createObjectURL(blob);
    link.download = `taxel-${name}-${new Date().toISOString().slice(0, 19).replace(/[:T]/g, "-")}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    say(`Saved ${link.download}`);
  });
}

// ---- Start ----

readTheme();
isDark.addEventListener("change", () => { readTheme(); fit(); });
new ResizeObserver(fit).observe(document.body);
setInterval(showRates, 250);
document.addEventListener("visibilitychange", connect);
connect();
