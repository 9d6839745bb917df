// node web/test/long_run_bench.mjs: size of the page of an 11 km run (long_run.mjs), and how long it takes to open in a
// headless Chromium that draws in software. DEMSLAM is the program (default: build/release/demslam).
import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser } from "./browser.mjs";

const OPENINGS = 5;
const demslam = process.env.DEMSLAM ?? "build/release/demslam";
const folder = mkdtempSync(join(tmpdir(), "demslam-long-"));
const page = join(folder, "report.html");
const seconds = (ms) => (ms / 1000).toFixed(2);
const timed = (work) => {
  const begin = performance.now();
  work();
  return performance.now() - begin;
};

/** Milliseconds from the request until everything is drawn and displayed, by the page's own clock. */
async function opening(browser, options) {
  const tab = await browser.page(options);
  await tab.open(pathToFileURL(page).href);
  await tab.until("document.documentElement.dataset.drawn");
  await tab.screenshot(); // what was drawn is there to be seen
  const ms = await tab.evaluate("performance.now()");
  if (tab.problems.length > 0) throw new Error(tab.problems.join("\n"));
  await tab.close();
  return ms;
}

try {
  execFileSync(process.execPath, [new URL("long_run.mjs", import.meta.url).pathname, folder]);
  const made = timed(() => execFileSync(demslam, ["report", join(folder, "long"), "-o", page], { stdio: "ignore" }));
  console.log(`page: ${(statSync(page).size / 1e6).toFixed(1)} MB, made in ${seconds(made)} s`);
  for (const [name, options] of [["desktop, 1440 x 900", { width: 1440, height: 900 }], ["phone, 390 x 844", { width: 390, height: 844, mobile: true }]]) {
    const times = [];
    for (let i = 0; i < OPENINGS; ++i) {
      const browser = await Browser.start(); // nothing is warm
      times.push(await opening(browser, options));
      await browser.close();
    }
    console.log(`${name}: opens in ${times.map(seconds).join(" ")} s`);
  }
} finally {
  rmSync(folder, { recursive: true, force: true });
}
