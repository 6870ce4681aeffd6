// The whole program at 500 frames a second, watched by headless Chromium: what is taken in, shown and lost, how old pictures are, and
// what program and page take of memory. Run it beside a build to see what a busy computer does to it.
//
//     (cd /tmp && npm install puppeteer-core)
//     NODE_PATH=/tmp/node_modules node proof/view/load.mjs target/release/taxel /usr/bin/chromium [SECONDS [RATE]]

import { spawn } from "node:child_process";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const puppeteer = createRequire(join(process.env.NODE_PATH ?? ".", "x"))("puppeteer-core");
const [program, chromium, seconds = "60", rate = "500"] = process.argv.slice(2);
const wait = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });

const feeder = spawn(program, ["view", "press", "--no-browser", "--frame-rate", rate], { stdio: ["ignore", "pipe", "inherit"] });
const address = await new Promise((resolve) => { feeder.stdout.once("data", (line) => resolve(`${line}`.trim())); });
const memory = () => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${feeder.pid}/status`, "utf8"))[1]) / 1024;

const browser = await puppeteer.launch({ executablePath: chromium, headless: true, args: ["--no-sandbox"] });
const page = await browser.newPage();
await page.setViewport({ width: 1280, height: 860 });
await page.goto(address);
await wait(5000);

const heap = async () => (await page.metrics()).JSHeapUsedSize / 1048576;
const before = { program: memory(), page: await heap() };
// What the page itself tells, ten times a second.
const ages = [], taken = [], shown = [];
for (const end = Date.now() + 1000 * Number(seconds); Date.now() < end; await wait(100)) {
  const [age, scan, drawn] = await page.evaluate(() => ["age", "scan_rate", "shown_rate"].map((id) => parseFloat(document.getElementById(id).textContent)));
  ages.push(age);
  taken.push(scan);
  shown.push(drawn);
}
const lost = await page.evaluate(() => document.getElementById("lost").textContent);
const of = (values, share) => values.filter(Number.isFinite).sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
console.log(`taken in: ${of(taken, 0.5)} frames a second of ${rate} (least ${of(taken, 0)}); lost ${lost}`);
console.log(`shown: ${of(shown, 0.5)} a second (least ${of(shown, 0)})`);
console.log(`age of the picture: ${of(ages, 0.5)} ms, 99 % below ${of(ages, 0.99)} ms`);
console.log(`memory: program ${before.program.toFixed(1)} to ${memory().toFixed(1)} MiB, page ${before.page.toFixed(1)} to ${(await heap()).toFixed(1)} MiB`);
await browser.close();
feeder.kill("SIGINT");
