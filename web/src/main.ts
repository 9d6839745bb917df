import "./style.css";
import type { PageData } from "./data";
import { pageOf, type Page } from "./data";
import { el } from "./dom";
import { fixed } from "./format";
import { Inspector } from "./inspector";
import { Plots } from "./plots";
import { Stage } from "./stage";
import { Store, type Selection } from "./store";
import { configuration, loopTable, methodOf, notes, runTable, timingTable } from "./tables";
import { listen } from "./live";
import { applyTheme, prefersDark, themeButton } from "./theme";

function firstSelection(page: Page): Selection | null {
  const run = page.runs.find((r) => r.views.length > 0) ?? page.runs.find((r) => r.keyframes.rows > 0);
  const keyframe = run?.views[Math.min(1, run.views.length - 1)]?.keyframe ?? run?.keyframes.column("number")[0];
  return run && keyframe !== undefined ? { run: run.index, keyframe } : null;
}

function newest(page: Page): Selection | null {
  const run = page.runs.at(-1);
  const keyframe = run?.views.at(-1)?.keyframe ?? run?.keyframes.column("number").at(-1);
  return run && keyframe !== undefined ? { run: run.index, keyframe } : null;
}

/** Nothing chosen counts as the newest. */
function isNewest(page: Page, selected: Selection | null): boolean {
  const last = newest(page);
  return !selected || (last !== null && last.run === selected.run && last.keyframe === selected.keyframe);
}

function datasetOf(page: Page): string {
  const inputs = page.runs[0]?.data.summary?.["inputs"] as { dataset?: string } | undefined;
  const parts = (inputs?.dataset ?? "").split("/").filter(Boolean);
  return parts.slice(-2).join("/") || "dataset not named";
}

function factsOf(page: Page): string {
  const terrain = page.terrain;
  const path = page.runs.map((run) => Number(run.data.evaluation?.["path_length_m"] ?? run.data.summary?.["path_length_m"])).find(Number.isFinite);
  const frames = page.runs[0]?.data.summary?.["frames_asked"];
  const facts = [
    path === undefined ? null : `${fixed(path, 1)} m`,
    typeof frames === "number" ? `${fixed(frames, 0)} frames` : null,
    terrain ? `terrain ${terrain.file}, drawn every ${fixed(terrain.step_m, terrain.step_m < 1 ? 2 : 1)} m` : "no terrain",
    page.truth ? "ground truth" : "no ground truth",
    `demslam ${page.data.demslam}`,
  ];
  return facts.filter(Boolean).join(" \u00b7 ");
}

/** Runs to show and hide, each with its colour. */
function legend(page: Page, store: Store): HTMLElement {
  const chip = (index: number, name: string) => {
    const button = el("button", { type: "button", class: "chip", "aria-pressed": String(!store.state.hidden.has(index)), style: `--run:var(--run-${index % 6})`, title: "show or hide this run" }, el("i", { class: "swatch" }), name);
    button.addEventListener("click", () => {
      const hidden = new Set(store.state.hidden);
      if (!hidden.delete(index)) hidden.add(index);
      store.set({ hidden });
      button.setAttribute("aria-pressed", String(!hidden.has(index)));
    });
    return button;
  };
  return el("nav", { class: "legend", "aria-label": "runs" }, ...page.runs.map((run) => chip(run.index, run.data.name)));
}

/** Parts of the page that are made anew when data arrive. */
function tables(page: Page, store: Store): { overview: HTMLElement; details: HTMLElement } {
  const section = (title: string, ...children: (HTMLElement | null)[]) => el("section", { class: "group" }, el("h2", {}, title), ...children);
  const remarks = notes(page);
  return {
    overview: el("section", { class: "group overview" }, runTable(page), el("p", { class: "method" }, methodOf(page))),
    details: el("div", {},
      section("Loop closures", loopTable(page, store)),
      section("Time per frame by stage", timingTable(page)),
      section("Configuration", configuration(page)),
      remarks && section("Remarks", remarks)),
  };
}

function start(data: PageData): void {
  let page = pageOf(data);
  const store = new Store({
    dark: prefersDark(),
    hidden: new Set(),
    selected: data.live ? newest(page) : firstSelection(page),
    cursor_m: null,
    layers: { truth: true, odometry: false, ellipses: true, loops: true, keyframes: true },
    exaggeration: 1,
    ellipseScale: 1,
  });
  applyTheme(store.state.dark);
  const stage = new Stage(page, store);
  const inspector = new Inspector(page, store);
  const plots = new Plots(page, store, () => (document.documentElement.dataset["drawn"] = "true"));
  let parts = tables(page, store);
  let runs = legend(page, store);
  const title = el("h1", {}, datasetOf(page));
  const facts = el("p", { class: "facts" }, factsOf(page));
  document.title = `demslam report: ${datasetOf(page)}`;
  document.getElementById("app")!.replaceChildren(
    el("header", { class: "top" }, el("div", { class: "mark" }, "demslam"), runs, themeButton(store)),
    el("main", {},
      el("div", { class: "title" }, title, facts),
      parts.overview,
      el("div", { class: "workbench" }, stage.element, inspector.element),
      plots.element,
      parts.details),
    el("footer", {}, "Map frame: East, North, up, metres. Errors and residuals as named; no value is smoothed."),
  );
  stage.start();
  plots.start();
  document.addEventListener("keydown", (event) => {
    if (event.target instanceof HTMLInputElement || event.target instanceof HTMLSelectElement || event.ctrlKey || event.metaKey) return;
    if (event.key === ".") inspector.step(1);
    if (event.key === ",") inspector.step(-1);
  });
  if (!data.live) return;
  listen(data.live, (news) => {
    const followed = isNewest(page, store.state.selected);
    page = pageOf({ ...news, live: data.live });
    const fresh = tables(page, store);
    parts.overview.replaceWith(fresh.overview);
    if (parts.details.querySelector("details[open]")) fresh.details = parts.details; // it is being read
    else parts.details.replaceWith(fresh.details);
    parts = fresh;
    title.textContent = datasetOf(page);
    const chips = legend(page, store);
    runs.replaceWith(chips);
    runs = chips;
    facts.textContent = factsOf(page);
    stage.update(page);
    inspector.update(page);
    plots.update(page);
    if (followed) store.set({ selected: newest(page) });
  });
}

start(JSON.parse(document.getElementById("demslam-data")!.textContent!) as PageData);
