// Opens report pages in a real, headless browser. DEMSLAM is the program, DATASET a small simulated dataset.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cpSync, mkdirSync, mkdtempSync, readFileSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { Browser, findBrowser } from "./browser.mjs";
import { writeLongRun } from "./long_run.mjs";

const { DEMSLAM, DATASET, SCREENSHOTS } = process.env;
const skip = findBrowser() ? false : "no Chromium here: scripts/setup --with-browser installs one";
const folder = mkdtempSync(join(tmpdir(), "demslam-page-"));
const demslam = (...args) => execFileSync(DEMSLAM, args, { stdio: ["ignore", "pipe", "pipe"] });
let browser;
let report;
let open = []; // pages of the present test

before(async () => {
  if (skip) return;
  demslam("run", DATASET, "-o", join(folder, "odometry"), "--odometry-only");
  demslam("run", DATASET, "-o", join(folder, "anchored"));
  report = join(folder, "report.html");
  demslam("report", join(folder, "odometry"), join(folder, "anchored"), "-o", report);
  browser = await Browser.start();
});

after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

afterEach(async () => {
  for (const page of open) await page.close();
  open = [];
});

async function opened(file, options = {}, by = browser) {
  const page = await by.page({ width: 1280, height: 800, ...options });
  if (by === browser) open.push(page);
  await page.open(pathToFileURL(file).href);
  await page.until(`document.documentElement.dataset.drawn`);
  return page;
}

/** Kept for people to look at, where a folder is named. */
async function keep(page, name) {
  if (!SCREENSHOTS) return;
  mkdirSync(SCREENSHOTS, { recursive: true });
  writeFileSync(join(SCREENSHOTS, `${name}.png`), await page.screenshot(true));
}

/** How many colours a canvas shows: one where nothing was drawn. */
const coloursOf = (page, selector) =>
  page.evaluate(`(() => {
    const source = document.querySelector(${JSON.stringify(selector)});
    const copy = Object.assign(document.createElement("canvas"), { width: source.width, height: source.height });
    const context = copy.getContext("2d");
    context.drawImage(source, 0, 0);
    const pixels = new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
    return new Set(pixels).size;
  })()`);

const textOf = (page, selector) => page.evaluate(`document.querySelector(${JSON.stringify(selector)}).textContent`);

/** The easternmost dot of the second run on the plan, in the window's pixels: its last keyframe. */
const lastKeyframeOnPlan = (page) =>
  page.evaluate(`(() => {
    const canvas = document.querySelector("#plan");
    const { width, height } = canvas;
    const pixels = new Uint32Array(canvas.getContext("2d").getImageData(0, 0, width, height).data.buffer);
    const inDot = (u, v) => [-1, 0, 1].every((du) => [-1, 0, 1].every((dv) => pixels[(v + dv) * width + u + du] === 0xffffb03d));
    const box = canvas.getBoundingClientRect();
    for (let u = width - 2; u > 0; --u) {
      for (let v = 1; v < height - 1; ++v) {
        if (inDot(u, v)) return { x: box.x + (u / width) * box.width, y: box.y + (v / height) * box.height };
      }
    }
    return null;
  })()`);

test("draws terrain, tracks, figures and tables without a console error", { skip }, async () => {
  const page = await opened(report);
  assert.ok((await coloursOf(page, "#space")) > 100, "the 3-D view is empty");
  assert.ok((await coloursOf(page, "#plan")) > 100, "the plan is empty");
  const plots = await page.evaluate(`document.querySelectorAll(".uplot canvas").length`);
  assert.ok(plots >= 6, `${plots} figures`);
  assert.match(await textOf(page, "table.runs"), /odometry.*anchored/);
  assert.match(await textOf(page, ".method"), /no alignment/);
  assert.ok(await page.evaluate(`document.querySelector(".inspector img").naturalWidth`) > 0, "no keyframe image");
  await keep(page, "desktop-light");
  assert.deepEqual(page.problems, []);
});

test("shows the keyframe that is clicked on the plan, and the next one", { skip }, async () => {
  const page = await opened(report);
  const first = await textOf(page, ".inspector h3");
  await page.click("#tab-plan");
  const at = await lastKeyframeOnPlan(page);
  assert.ok(at, "no keyframe on the plan");
  await page.clickAt(at.x, at.y);
  const clicked = await textOf(page, ".inspector h3");
  assert.notEqual(clicked, first);
  await page.click("#previous-keyframe");
  const before = await textOf(page, ".inspector h3");
  assert.notEqual(before, clicked);
  await page.press(".");
  assert.equal(await textOf(page, ".inspector h3"), clicked);
  await keep(page, "plan");
  assert.deepEqual(page.problems, []);
});

test("follows the system's theme and the reader's choice", { skip }, async () => {
  const page = await opened(report, { dark: true });
  const theme = () => page.evaluate(`[document.documentElement.dataset.theme, getComputedStyle(document.body).backgroundColor]`);
  const dark = await theme();
  assert.equal(dark[0], "dark");
  await keep(page, "desktop-dark");
  await page.click("#theme");
  const light = await theme();
  assert.equal(light[0], "light");
  assert.notEqual(light[1], dark[1]);
  await page.evaluate("localStorage.clear()");
  assert.deepEqual(page.problems, []);
});

test("hides a run everywhere", { skip }, async () => {
  const page = await opened(report);
  const before = await coloursOf(page, ".uplot canvas");
  for (const chip of [1, 2]) await page.click(`.legend .chip:nth-child(${chip})`);
  assert.equal(await page.evaluate(`document.querySelectorAll(".uplot").length`), 0);
  await page.click(".legend .chip:nth-child(1)");
  assert.ok((await coloursOf(page, ".uplot canvas")) !== before);
  assert.deepEqual(page.problems, []);
});

test("turns with the arrow keys and zooms with plus and minus", { skip }, async () => {
  const page = await opened(report);
  const picture = () => page.evaluate(`document.querySelector("#space").toDataURL()`);
  const still = await picture();
  await page.evaluate(`document.querySelector("#space").focus()`);
  await page.press("ArrowLeft");
  const turned = await picture();
  assert.notEqual(turned, still);
  await page.press("+");
  assert.notEqual(await picture(), turned);
  assert.deepEqual(page.problems, []);
});

test("fits a phone", { skip }, async () => {
  for (const dark of [false, true]) {
    const page = await opened(report, { width: 390, height: 844, mobile: true, dark });
    assert.ok((await page.evaluate("document.documentElement.scrollWidth")) <= 390, "the page is wider than the phone");
    await keep(page, `phone-${dark ? "dark" : "light"}`);
    assert.deepEqual(page.problems, []);
  }
});

test("shows the plan where there is no WebGL", { skip }, async () => {
  const without = await Browser.start({ webgl: false });
  try {
    const page = await opened(report, {}, without);
    assert.match(await textOf(page, ".stage-message"), /no WebGL/);
    assert.equal(await page.evaluate(`document.querySelector(".stage").dataset.mode`), "plan");
    assert.ok((await coloursOf(page, "#plan")) > 100);
  } finally {
    await without.close();
  }
});

test("is whole without truth, DEM, images and map", { skip }, async () => {
  const bare = join(folder, "bare");
  cpSync(join(folder, "odometry"), bare, { recursive: true });
  rmSync(join(bare, "map.db"), { force: true });
  const summary = JSON.parse(readFileSync(join(bare, "summary.json")));
  summary.inputs.dataset = "/nowhere";
  writeFileSync(join(bare, "summary.json"), JSON.stringify(summary));
  demslam("report", bare, "-o", join(folder, "bare.html"));
  const page = await opened(join(folder, "bare.html"));
  assert.match(await textOf(page, ".method"), /No ground truth/);
  assert.match(await textOf(page, ".notes"), /no keyframe images/);
  assert.ok((await coloursOf(page, "#space")) > 1);
  await keep(page, "bare");
  assert.deepEqual(page.problems, []);
});

test("an 11 km run stays below 20 MB and opens", { skip }, async (t) => {
  const file = join(folder, "long.html");
  demslam("report", writeLongRun(folder), "-o", file);
  const megabytes = statSync(file).size / 1e6;
  assert.ok(megabytes < 20, `${megabytes} MB`);
  const begin = performance.now();
  const page = await opened(file);
  t.diagnostic(`${megabytes.toFixed(1)} MB, opened and drawn in ${Math.round(performance.now() - begin)} ms`);
  assert.ok((await coloursOf(page, "#space")) > 10);
  assert.equal(await page.evaluate(`document.querySelectorAll(".missing").length <= 2`), true);
  await keep(page, "long");
  assert.deepEqual(page.problems, []);
});
