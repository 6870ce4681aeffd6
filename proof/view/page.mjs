// The page of the live view in headless Chromium: what it shows, what its keys do, what it asks, how it comes back, how old its
// pictures are. Exits with 1 if anything is wrong.
//
//     cargo build --release -p taxel-view --example synthetic
//     (cd /tmp && npm install puppeteer-core)
//     NODE_PATH=/tmp/node_modules node proof/view/page.mjs target/release/examples/synthetic /usr/bin/chromium [SECONDS]

import { spawn } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { connect, createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

const puppeteer = createRequire(join(process.env.NODE_PATH ?? ".", "x"))("puppeteer-core");
const [program, chromium, seconds = "20"] = process.argv.slice(2);
const TOKEN = "0123456789abcdef0123";

let faults = 0;
function check(isRight, words) {
  console.log(`${isRight ? "ok   " : "WRONG"} ${words}`);
  if (!isRight) faults += 1;
}
const wait = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

/** Starts the example; returns the process and the address that it prints. */
async function feed(...options) {
  const feeder = spawn(program, [`token=${TOKEN}`, ...options], { stdio: ["ignore", "pipe", "inherit"] });
  const address = await new Promise((resolve) => { feeder.stdout.once("data", (line) => resolve(`${line}`.trim())); });
  return [feeder, address];
}

async function stop(feeder) {
  const gone = new Promise((resolve) => { feeder.once("exit", resolve); });
  feeder.kill();
  await gone;
}

const browser = await puppeteer.launch({ executablePath: chromium, headless: true, args: ["--no-sandbox"] });
const downloads = mkdtempSync(join(tmpdir(), "taxel-view-"));

/** Opens a page, and collects what it complains about and asks from elsewhere. */
async function open(address, width = 1440, height = 900) {
  const page = await browser.newPage(), noticed = { errors: [], foreign: [], dialogs: 0 };
  page.on("console", (message) => {
    // A refused command is an answer of status 409, which Chromium notes by itself.
    const isAnswer = message.text().includes("status of 409");
    if (["error", "warn"].includes(message.type()) && !isAnswer) noticed.errors.push(message.text());
  });
  page.on("pageerror", (error) => noticed.errors.push(error.message));
  page.on("dialog", (dialog) => { noticed.dialogs += 1; dialog.dismiss(); });
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (url.protocol !== "blob:" && url.host !== new URL(address).host) noticed.foreign.push(request.url());
  });
  await page.setViewport({ width, height });
  await page.goto(address);
  await page.waitForFunction(() => document.querySelector("#shown_rate").textContent > 0, { timeout: 10000 });
  return [page, noticed];
}

/** A canvas's pixels. */
const pixels = (page, id) => page.evaluate((id) => document.getElementById(id).toDataURL(), id);
const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
const pressed = (page, id) => page.$eval(`#${id}`, (element) => element.getAttribute("aria-pressed"));
const until = (page, test, ...values) => page.waitForFunction(test, { timeout: 10000, polling: 50 }, ...values).then(() => true, () => false);
const reads = (page, id, pattern) => until(page, (id, pattern) => new RegExp(pattern).test(document.getElementById(id).textContent), id, pattern);

// ---- A device: pictures, keys, reconnection ----
{
  let [feeder, address] = await feed("show=device", "rate=200");
  const [page, noticed] = await open(address), port = new URL(address).port;
  const session = await page.createCDPSession();
  await session.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: downloads });

  check(await until(page, () => frame?.contact?.depth_mm > 0.5), "a press comes");
  const deep = [await pixels(page, "sheet"), await pixels(page, "matrix")];
  check(await until(page, () => frame && !frame.contact), "the press goes");
  await wait(150);
  const flat = [await pixels(page, "sheet"), await pixels(page, "matrix")];
  check(deep[0] !== flat[0] && deep[1] !== flat[1], "pixels of sheet and matrix change with the press");

  await page.keyboard.press("b");
  check(await reads(page, "answer", "Zeroed on|Not zeroed"), `b: ${await text(page, "answer")}`);
  await until(page, () => frame?.contact?.depth_mm > 0.3);
  await page.keyboard.press("b");
  check(await reads(page, "answer", "Not zeroed: something presses"), `b while touched: ${await text(page, "answer")}`);
  await page.keyboard.press(" ");
  check(await reads(page, "state", "paused"), "space pauses");
  const still = await page.evaluate(() => frame.number);
  await wait(400);
  check(still === await page.evaluate(() => frame.number), "and the picture stands still");
  await page.keyboard.press(" ");
  check(await reads(page, "state", "live"), "space goes on");
  await page.keyboard.press("r");
  check(await reads(page, "recording", "synthetic\\.mcap: .+, [\\d.]+ s"), `r records: ${await text(page, "recording")}`);
  await page.keyboard.press("r");
  check(await reads(page, "recording", "^$"), "r ends the recording");
  for (const [key, id] of [["n", "numbers"], ["3", "third"]]) {
    await page.keyboard.press(key);
    check(await pressed(page, id) === "true", `${key} switches on`);
    await wait(100);
    if (key === "3") {
      const before = await page.evaluate(() => sheet.turn.yaw), box = await (await page.$("#sheet")).boundingBox();
      await page.mouse.move(box.x + 200, box.y + 200);
      await page.mouse.down();
      await page.mouse.move(box.x + 260, box.y + 220, { steps: 4 });
      await page.mouse.up();
      check(before !== await page.evaluate(() => sheet.turn.yaw), "dragging turns the sheet");
      await page.focus("#sheet");
      const dragged = await page.evaluate(() => sheet.turn.yaw);
      await page.keyboard.press("ArrowLeft");
      check(dragged !== await page.evaluate(() => sheet.turn.yaw), "arrow keys turn it too");
    }
    await page.keyboard.press(key);
    check(await pressed(page, id) === "false", `${key} switches off`);
  }
  await page.keyboard.press("+");
  check(await page.evaluate(() => sheet.scale) === 2, "+ doubles the scale");
  await page.keyboard.press("-");
  await page.keyboard.press("-");
  check(await page.evaluate(() => sheet.scale) === 0.5, "- halves it");
  await page.keyboard.press("0");
  check(await page.evaluate(() => sheet.scale) === 1, "0 resets it");
  await page.click("#absolute");
  check(await pressed(page, "absolute") === "true" && await pressed(page, "relative") === "false", "Ω instead of ΔR/R₀");

  await page.keyboard.press("s");
  let saved = [];
  for (let tries = 0; tries < 50 && !saved.length; tries++) {
    await wait(100);
    saved = readdirSync(downloads).filter((name) => name.endsWith(".png"));
  }
  const picture = saved.length ? readFileSync(join(downloads, saved[0])) : Buffer.alloc(0);
  check(picture.subarray(1, 4).toString() === "PNG" && picture.length > 20000, `s saves ${saved[0]}, ${picture.length} bytes`);

  for (const [id, words] of [["sheet", "r\\d+e\\d+\nat .* mm\nΔx .* ± .* mm\nΔy .*\nΔz"], ["matrix", "r\\d+c\\d+\nrow \\d+, column \\d+\n[\\d.]+ Ω\nΔR/R₀"]]) {
    const box = await (await page.$(`#${id}`)).boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    check(await reads(page, "tip", words), `hover: ${(await text(page, "tip")).replaceAll("\n", " | ")}`);
  }
  check(noticed.errors.length === 0, `no complaint in the console ${noticed.errors}`);

  await stop(feeder);
  check(await reads(page, "banner", `does not answer.*--http-port ${port} --token ${TOKEN}`), `without the server: ${await text(page, "banner")}`);
  await wait(2500);
  const stopped = Date.now();
  [feeder] = await feed("show=device", "rate=200", `port=${port}`);
  check(await reads(page, "state", "live"), `live again ${Date.now() - stopped} ms after the server is back`);
  check(noticed.foreign.length === 0, `no request to anywhere else ${noticed.foreign}`);
  const kinds = [...new Set(noticed.errors)];
  check(kinds.every((words) => /ERR_(CONNECTION|INCOMPLETE|EMPTY|SOCKET)/.test(words)), `complaints of the network alone while it was gone: ${kinds}`);
  await page.close();
  await stop(feeder);
}

// ---- More tabs than a browser has connections to a host ----
{
  const [feeder, address] = await feed("show=device"), pages = [];
  for (let count = 0; count < 8; count++) pages.push(await browser.newPage());
  for (const page of pages) await page.goto(address, { waitUntil: "domcontentloaded" });
  const page = pages[7];
  await page.bringToFront();
  check(await reads(page, "shown_rate", "[1-9]"), "the eighth tab shows pictures");
  await page.keyboard.press("r");
  check(await reads(page, "recording", "mcap"), "and records");
  await page.keyboard.press(" ");
  check(await reads(page, "state", "paused"), "and pauses");
  for (const page of pages) await page.close();
  await stop(feeder);
}

// ---- A recording ----
{
  const [feeder, address] = await feed("show=recording", "rate=100");
  const [page, noticed] = await open(address);
  check(await reads(page, "state", "playing"), "a recording plays");
  await page.$eval("#position", (slider) => {
    slider.value = 30;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    slider.dispatchEvent(new Event("change", { bubbles: true }));
  });
  check(await until(page, () => frame.time_us > 29e6 && frame.time_us < 33e6), "the slider goes to 30 s");
  await page.keyboard.press(".");
  check(await reads(page, "state", "paused"), ". steps and waits");
  await wait(200);
  const at = await page.evaluate(() => frame.time_us);
  await page.keyboard.press(",");
  check(await until(page, (at) => frame.time_us === at - 10000 || frame.time_us === at - 9999 || frame.time_us === at - 10001, at), ", steps one frame back");
  await page.$eval("#speed", (slider) => {
    slider.value = 1;
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  });
  check(await until(page, () => status.speed === 10), "the speed is 10");
  check(noticed.errors.length === 0, `no complaint in the console ${noticed.errors}`);
  await page.close();
  await stop(feeder);
}

// ---- Words, names that are scripts, outputs without electrodes, a narrow screen ----
for (const [show, id, pattern] of [
  ["fault", "banner", "18 of 144 readings are missing\\. Row 3 is open"], ["fault", "wires", "Row 3: open"],
  ["novel", "banner", "do not trust the picture\\. Out of range"], ["hostile", "title", "<img src=x onerror"],
  ["values", "values", "temperature"], ["simulation", "times_limit", "\\d\\.\\d\\d"],
]) {
  const [feeder, address] = await feed(`show=${show}`);
  const [page, noticed] = await open(address, 390, 844);
  check(await reads(page, id, pattern), `${show}: ${(await text(page, id)).slice(0, 90)}`);
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= 390 && !noticed.errors.length && !noticed.dialogs && !noticed.foreign.length, `${show}: ${wide} px wide, quiet ${noticed.errors}`);
  await page.close();
  await stop(feeder);
}

// ---- A slow way, such as a tunnel through a mobile phone: pictures become fewer, not older ----
{
  const [feeder, address] = await feed("show=simulation", "rate=500"), limit = 120_000;
  const proxy = createServer((near) => {
    const far = connect(new URL(address).port, "127.0.0.1"), waiting = [];
    let [budget, isOver] = [0, false];
    const clock = setInterval(() => {
      budget = Math.min(budget + limit / 50, limit / 5);
      while (waiting.length && budget > 0) {
        budget -= waiting[0].length;
        near.write(waiting.shift());
      }
      if (!waiting.length && isOver) near.end();
      else if (!waiting.length) far.resume();
    }, 20);
    near.pipe(far);
    far.on("data", (piece) => { waiting.push(piece); far.pause(); });
    for (const end of [near, far]) end.on("error", () => { near.destroy(); far.destroy(); });
    far.on("close", () => { isOver = true; });
    near.on("close", () => { clearInterval(clock); far.destroy(); });
  }).listen(0, "127.0.0.1");
  await new Promise((resolve) => { proxy.on("listening", resolve); });
  const [page] = await open(address.replace(new URL(address).port, proxy.address().port));
  check(await page.waitForFunction(() => rate && rate < 30, { timeout: 30000 }).then(() => true, () => false), "behind 120 kB/s the page asks for fewer frames");
  await wait(5000);
  const [shown, age] = [+await text(page, "shown_rate"), +await text(page, "age")];
  check(shown >= 4 && age < 1500, `and shows ${shown} pictures/s, ${age} ms old`);
  await page.close();
  proxy.close();
  await stop(feeder);
}

// ---- Rate and age ----
{
  const [feeder, address] = await feed("show=device", "rate=500");
  const [page, noticed] = await open(address);
  await wait(2000);
  const pictures = new Map(), start = Date.now();
  while (Date.now() - start < seconds * 1000) {
    await wait(500);
    for (const [time, age] of await page.evaluate(() => drawn)) pictures.set(time, age);
  }
  const times = [...pictures.keys()].sort((a, b) => a - b), ages = [...pictures.values()].sort((a, b) => a - b);
  const rate = (times.length - 1) / (times.at(-1) - times[0]) * 1000;
  const [median, worst] = [0.5, 0.99].map((share) => ages[Math.floor(share * (ages.length - 1))]);
  check(rate > 20 && median < 60, `500 frames/s in: ${rate.toFixed(1)} pictures/s, age ${median.toFixed(1)} ms median, ${worst.toFixed(1)} ms p99 over ${seconds} s`);
  check(noticed.errors.length === 0, `no complaint in the console ${noticed.errors}`);
  await page.close();
  await stop(feeder);
}

await browser.close();
rmSync(downloads, { recursive: true });
console.log(faults ? `${faults} wrong` : "all right");
process.exit(faults ? 1 : 0);
