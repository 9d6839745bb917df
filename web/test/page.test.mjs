// Opens report pages in a real, headless browser. DEMSLAM is the program, PAGE the page that was built into it (empty
// where that failed), DATASET a small simulated dataset.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, afterEach, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { Browser, skipReason } from "./browser.mjs";

const { DEMSLAM, DATASET, SCREENSHOTS } = process.env;
const skip = skipReason();
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

async function opened(options = {}) {
  const page = await browser.page({ width: 1280, height: 800, ...options });
  open.push(page);
  await page.open(pathToFileURL(report).href);
  await page.until(`document.documentElement.dataset.drawn`);
  await page.until(`document.querySelector(".inspector img")?.naturalWidth > 0`);
  await page.settle();
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
    const inDot = (u, v) => [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]].every(([du, dv]) => pixels[(v + dv) * width + u + du] === 0xffffb03d);
    const box = canvas.getBoundingClientRect();
    for (let u = width - 2; u > 0; --u) {
      for (let v = 1; v < height - 1; ++v) {
        if (inDot(u, v)) return { x: box.x + (u / width) * box.width, y: box.y + (v / height) * box.height };
      }
    }
    return null;
  })()`);

test("draws terrain, tracks, figures and tables without a console error", { skip }, async () => {
  const page = await opened();
  assert.ok((await coloursOf(page, "#space")) > 100, "the 3-D view is empty");
  assert.ok((await coloursOf(page, "#plan")) > 100, "the plan is empty");
  const plots = await page.evaluate(`document.querySelectorAll(".uplot canvas").length`);
  assert.ok(plots >= 6, `${plots} figures`);
  assert.match(await textOf(page, "table.runs"), /odometry.*anchored/);
  assert.match(await textOf(page, ".method"), /no alignment/);
  await keep(page, "desktop-light");
  assert.deepEqual(page.problems, []);
});

test("shows the keyframe that is clicked on the plan, and the next one", { skip }, async () => {
  const page = await opened();
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
  const page = await opened({ dark: true });
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

test("shows the plan where the browser has no WebGL", { skip }, async () => {
  const without = await Browser.start({ webgl: false });
  try {
    const page = await without.page();
    await page.open(pathToFileURL(report).href);
    await page.until(`document.documentElement.dataset.drawn`);
    await page.settle();
    assert.equal(await page.evaluate(`document.querySelector(".stage").dataset.mode`), "plan");
    assert.ok((await coloursOf(page, "#plan")) > 100, "the plan is empty");
    assert.match(await textOf(page, ".stage-message"), /no WebGL/);
  } finally {
    await without.close();
  }
});

test("fits a phone", { skip }, async () => {
  const page = await opened({ width: 390, height: 844, mobile: true });
  assert.ok((await page.evaluate("document.documentElement.scrollWidth")) <= 390, "the page is wider than the phone");
  await keep(page, "phone-light");
  assert.deepEqual(page.problems, []);
});
