// A run that is watched: `demslam run --live` over HTTP and in a headless browser. DEMSLAM is the program, PAGE the page
// that was built into it, SCENE a small scene, whose images are rendered as they are read so that the run takes seconds.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { Browser, skipReason } from "./browser.mjs";

const { DEMSLAM, SCENE, SCREENSHOTS } = process.env;
const skip = skipReason({ browser: false });
const folder = mkdtempSync(join(tmpdir(), "demslam-live-"));
const dataset = join(folder, "data");
const started = (name, ...more) => spawn(DEMSLAM, ["run", dataset, "-o", join(folder, name), ...more], { stdio: ["ignore", "ignore", "pipe"] });
let browser; // null where none is installed

before(async () => {
  if (skip) return;
  execFileSync(DEMSLAM, ["simulate", SCENE, "-o", dataset, "--no-images"], { stdio: "ignore" });
  browser = skipReason() ? null : await Browser.start();
});
after(async () => {
  await browser?.close();
  rmSync(folder, { recursive: true, force: true });
});

/** {code, said}: how a process ended. */
function outcome(child) {
  let said = "";
  child.stderr.setEncoding("utf8").on("data", (part) => (said += part));
  return new Promise((resolve) => child.once("exit", (code) => resolve({ code, said })));
}

const addressOf = (child) =>
  new Promise((resolve) => {
    let text = "";
    child.stderr.on("data", (part) => {
      const line = /^live: (\S+)\n/m.exec((text += part));
      if (line) resolve(line[1]);
    });
  });

async function answer(url) {
  const response = await fetch(url);
  return { status: response.status, type: response.headers.get("content-type"), text: await response.text() };
}

const eventsIn = (text) => [...text.matchAll(/event: (.*)\ndata: (.*)\n\n/g)].map(([, name, data]) => ({ name, data: JSON.parse(data) }));

async function followed(address) {
  const page = await browser.page({ width: 1280, height: 800 });
  await page.open(address);
  await page.until(`document.querySelector(".live")?.textContent === "finished"`);
  await page.settle();
  return page;
}

test("serves a run to its end, over HTTP and in a browser, and leaves its bytes as they are", { skip }, async () => {
  const run = started("watched", "--live", "0");
  const watched = outcome(run);
  const address = await addressOf(run);
  const second = outcome(started("second", "--live", new URL(address).port));
  const alone = outcome(started("alone"));
  const seen = browser && followed(address);
  const [index, missing, events] = await Promise.all(["/", "nothing", "events"].map((path) => answer(new URL(path, address))));

  assert.equal(index.status, 200);
  assert.match(index.type, /^text\/html/);
  assert.match(index.text, /"live":"events"/);
  assert.equal(missing.status, 404);
  const [state, end] = eventsIn(events.text).slice(-2);
  assert.equal(end.name, "end");
  assert.equal(state.data.runs[0].summary.counters.tracked, state.data.runs[0].summary.frames_asked);

  const refused = await second;
  assert.equal(refused.code, 1);
  assert.match(refused.said, /^demslam: error: --live: port \d+ cannot be had.*\n$/);

  assert.deepEqual([(await watched).code, (await alone).code], [0, 0]);
  for (const name of ["trajectory.tum", "odometry.tum", "covariance.csv", "residuals.csv", "frames.jsonl", "config.toml", "summary.json"]) {
    assert.ok(readFileSync(join(folder, "watched", name)).equals(readFileSync(join(folder, "alone", name))), `${name} differs`);
  }

  const page = await seen;
  if (!page) return;
  assert.match(await page.evaluate(`document.querySelector("table.runs tbody").textContent`), /^watched/);
  assert.ok((await page.evaluate(`document.querySelectorAll(".uplot canvas").length`)) >= 4);
  if (SCREENSHOTS) {
    mkdirSync(SCREENSHOTS, { recursive: true });
    writeFileSync(join(SCREENSHOTS, "live.png"), await page.screenshot(true));
  }
  assert.deepEqual(page.problems, []);
});
