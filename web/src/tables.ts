import type { LoopData, Page, Run } from "./data";
import { el } from "./dom";
import { bytes, fixed, NONE } from "./format";
import { stageColour } from "./palette";
import type { Store } from "./store";

type Json = Record<string, unknown>;

/** A number at a path like "counters.loops.accepted"; NaN where there is none. */
function number(json: Json | null, path: string): number {
  let value: unknown = json;
  for (const key of path.split(".")) value = (value as Json | null | undefined)?.[key];
  return typeof value === "number" ? value : NaN;
}

interface Metric {
  group: string;
  name: string;
  unit: string;
  of: (run: Run) => number;
  decimals: number;
  best?: "least"; // which of the runs is set in bold
}

const evaluated = (path: string) => (run: Run) => number(run.data.evaluation, path);
const summarised = (path: string) => (run: Run) => number(run.data.summary, path);

const METRICS: Metric[] = [
  { group: "Run", name: "path", unit: "m", of: (run) => number(run.data.evaluation, "path_length_m") || number(run.data.summary, "path_length_m"), decimals: 1 },
  { group: "Run", name: "done", unit: "%", of: (run) => completion(run), decimals: 1 },
  { group: "Run", name: "keyframes", unit: "", of: summarised("counters.keyframes"), decimals: 0 },
  { group: "Run", name: "loops", unit: "", of: summarised("counters.loops.accepted"), decimals: 0 },
  { group: "Run", name: "DEM factors", unit: "", of: demFactors, decimals: 0 },
  { group: "ATE, RMSE", name: "total", unit: "m", of: evaluated("ate_rmse_m"), decimals: 3, best: "least" },
  { group: "ATE, RMSE", name: "horizontal", unit: "m", of: evaluated("ate_horizontal_rmse_m"), decimals: 3, best: "least" },
  { group: "ATE, RMSE", name: "vertical", unit: "m", of: evaluated("ate_vertical_rmse_m"), decimals: 3, best: "least" },
  { group: "ATE, RMSE", name: "SE(3)-aligned", unit: "m", of: evaluated("ate_se3_rmse_m"), decimals: 3, best: "least" },
  { group: "Relative", name: "ATE*", unit: "", of: evaluated("ate_star"), decimals: 5, best: "least" },
  { group: "Relative", name: "drift", unit: "%", of: evaluated("drift_percent"), decimals: 3, best: "least" },
  { group: "RPE, RMSE", name: "translation", unit: "m", of: evaluated("rpe_rmse_m"), decimals: 4, best: "least" },
  { group: "RPE, RMSE", name: "rotation", unit: "\u00b0", of: evaluated("rpe_rotation_rmse_deg"), decimals: 4, best: "least" },
  { group: "Covariance", name: "mean NEES", unit: "", of: evaluated("nees_mean"), decimals: 2 },
  { group: "DEM lies off by", name: "East", unit: "m", of: summarised("dem_shift.m.0"), decimals: 2 },
  { group: "DEM lies off by", name: "North", unit: "m", of: summarised("dem_shift.m.1"), decimals: 2 },
  { group: "DEM lies off by", name: "up", unit: "m", of: summarised("dem_shift.m.2"), decimals: 2 },
  { group: "DEM's noise", name: "over what was stated", unit: "", of: summarised("counters.dem_factors.noise_scale"), decimals: 1 },
  { group: "Cost", name: "time per frame", unit: "ms", of: (run) => run.data.timings["total_ms"]?.median ?? NaN, decimals: 0 },
  { group: "Cost", name: "memory", unit: "MiB", of: (run) => run.data.timings["rss_mib"]?.max ?? NaN, decimals: 0 },
];

function completion(run: Run): number {
  const share = number(run.data.evaluation, "completion");
  if (Number.isFinite(share)) return 100 * share;
  return (100 * number(run.data.summary, "counters.tracked")) / number(run.data.summary, "frames_asked");
}

/** NaN while the run goes on. */
function demFactors(run: Run): number {
  const of = (kind: string) => number(run.data.summary, `counters.dem_factors.${kind}`);
  return of("height") + of("normal") + of("patches");
}

/** What a reader must know before comparing a run with others. */
function stateOf(run: Run): HTMLElement | null {
  const state = ["interrupted", "running"].find((name) => run.data.summary?.[name] === true);
  return state ? el("em", {}, ` ${state}`) : null;
}

const swatch = (run: Run) => el("i", { class: "swatch", style: `--run:var(--run-${run.index % 6})` });

/** What was measured how: the alignment and the RPE's step. */
export function methodOf(page: Page): string {
  const evaluation = page.runs.find((run) => run.data.evaluation)?.data.evaluation;
  if (!evaluation) return "No ground truth: nothing to evaluate.";
  const alignment = { none: "no alignment", first: "first pose aligned", se3: "SE(3) Umeyama alignment", sim3: "Sim(3) Umeyama alignment" }[String(evaluation["alignment"])] ?? String(evaluation["alignment"]);
  return `ATE: ${alignment}, except where the column names another. RPE: ${evaluation["rpe"]}. Time: median, wall clock. Memory: most. Bold: best of the runs.`;
}

/** The runs side by side. */
export function runTable(page: Page): HTMLElement {
  const metrics = METRICS.filter((metric) => page.runs.some((run) => Number.isFinite(metric.of(run))));
  const groups = [...new Set(metrics.map((metric) => metric.group))];
  const best = (metric: Metric) => {
    const values = page.runs.map(metric.of).filter(Number.isFinite);
    return metric.best && page.runs.length > 1 ? Math.min(...values) : NaN;
  };
  return el("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "runs side by side" },
    el("table", { class: "runs" },
      el("thead", {},
        el("tr", {}, el("th", { rowspan: 2, scope: "col" }, "run"),
          ...groups.map((group) => el("th", { class: "group", colspan: metrics.filter((m) => m.group === group).length }, group))),
        el("tr", {}, ...metrics.map((metric, i) =>
          el("th", { scope: "col", class: metrics[i - 1]?.group === metric.group ? undefined : "first" }, metric.name, metric.unit ? el("span", { class: "unit" }, ` [${metric.unit}]`) : null)))),
      el("tbody", {},
        ...page.runs.map((run) =>
          el("tr", {}, el("th", { scope: "row" }, swatch(run), run.data.name, stateOf(run)),
            ...metrics.map((metric, i) => {
              const value = metric.of(run);
              const classes = [metrics[i - 1]?.group === metric.group ? "" : "first", value === best(metric) ? "best" : ""];
              return el("td", { class: classes.join(" ").trim() || undefined }, fixed(value, metric.decimals));
            }))))));
}

/** Mean time per frame by stage, as bars on one scale, and the figures. */
export function timingTable(page: Page): HTMLElement {
  const runs = page.runs.filter((run) => Object.keys(run.data.timings).length > 0);
  if (runs.length === 0) return el("p", { class: "missing" }, "The runs wrote no timings.csv.");
  const stages = [...new Set(runs.flatMap((run) => Object.keys(run.data.timings)))].filter((name) => name.endsWith("_ms") && name !== "total_ms");
  const longest = Math.max(...runs.map((run) => run.data.timings["total_ms"]?.mean ?? 0), 1e-9);
  const label = (name: string) => name.replace(/_ms$/, "").replaceAll("_", " ");
  const bar = (run: Run) => {
    const of = (name: string) => run.data.timings[name]?.mean ?? 0;
    const rest = Math.max(0, of("total_ms") - stages.reduce((sum, stage) => sum + of(stage), 0));
    const part = (name: string, mean: number, colour: string) =>
      el("span", { style: `width:${(100 * mean) / longest}%;background:${colour}`, title: `${name}: ${fixed(mean, 1)} ms` });
    return el("div", { class: "bar-row" }, el("span", { class: "bar-name" }, swatch(run), run.data.name),
      el("div", { class: "bar" }, ...stages.map((stage, i) => part(label(stage), of(stage), stageColour(i))), part("other", rest, "var(--rest)")),
      el("span", { class: "bar-total" }, `${fixed(of("total_ms"), 1)} ms`));
  };
  const row = (run: Run, stage: string, i: number) => {
    const s = run.data.timings[stage];
    return el("tr", {}, el("th", { scope: "row" }, stage === "total_ms" ? null : el("i", { class: "swatch", style: `--run:${stageColour(i)}` }), label(stage)),
      ...runs.length > 1 ? [el("td", { class: "text" }, run.data.name)] : [],
      ...[s?.mean, s?.median, s?.p95, s?.max].map((value) => el("td", {}, fixed(value, 1))));
  };
  return el("div", {},
    el("div", { class: "bars", role: "img", "aria-label": "mean time per frame by stage" }, ...runs.map(bar)),
    el("div", { class: "wide", tabindex: 0, role: "region", "aria-label": "time per frame by stage" },
      el("table", {},
        el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "stage"), ...(runs.length > 1 ? [el("th", { scope: "col", class: "text" }, "run")] : []),
          ...["mean", "median", "95 %", "max"].map((name) => el("th", { scope: "col" }, name, el("span", { class: "unit" }, " [ms]"))))),
        el("tbody", {}, ...[...stages, "total_ms"].flatMap((stage, i) => runs.filter((run) => run.data.timings[stage]).map((run) => row(run, stage, i)))))));
}

const MAX_LOOPS = 300;

/** Every attempt to close a loop; a click shows its keyframe. */
export function loopTable(page: Page, store: Store): HTMLElement {
  const loops = page.runs.flatMap((run) => run.data.loops.map((loop) => ({ run, loop })));
  const rank = (loop: LoopData) => ["accepted", "inconsistent"].indexOf(loop.status) >>> 0;
  const shown = loops.sort((a, b) => rank(a.loop) - rank(b.loop)).slice(0, MAX_LOOPS);
  if (shown.length === 0) return el("p", { class: "missing" }, "No run tried to close a loop: the rover did not come back to a place it had seen.");
  const select = (run: Run, loop: LoopData) => () => loop.keyframe !== undefined && store.set({ selected: { run: run.index, keyframe: loop.keyframe } });
  return el("div", { class: "wide tall", tabindex: 0, role: "region", "aria-label": "loop closures" },
    el("table", {},
      el("thead", {}, el("tr", {}, ...["run", "keyframe", "seen again"].map((h) => el("th", { scope: "col" }, h)),
        el("th", { scope: "col" }, "driven", el("span", { class: "unit" }, " [m]")), el("th", { scope: "col" }, "path between", el("span", { class: "unit" }, " [m]")),
        el("th", { scope: "col" }, "inliers"), el("th", { scope: "col", class: "text" }, "outcome"))),
      el("tbody", {}, ...shown.map(({ run, loop }) =>
        el("tr", {}, el("th", { scope: "row" }, swatch(run), run.data.name),
          el("td", {}, loop.keyframe === undefined ? NONE : el("button", { type: "button", class: "link", onclick: select(run, loop) }, String(loop.keyframe))),
          el("td", {}, loop.to_keyframe === undefined ? NONE : String(loop.to_keyframe)),
          el("td", {}, fixed(loop.distance_m, 1)),
          el("td", {}, fixed(loop.to_distance_m === undefined ? NaN : loop.distance_m - loop.to_distance_m, 1)),
          el("td", {}, fixed(loop.inliers, 0)),
          el("td", { class: "text" }, loop.status, loop.reason ? el("small", {}, ` ${loop.reason}`) : null))))),
    loops.length > MAX_LOOPS ? el("p", { class: "missing" }, `${MAX_LOOPS} of ${loops.length} attempts, accepted ones first.`) : null);
}

/** "section.key" -> value, as a TOML file writes it. */
function entriesOf(toml: string): Map<string, string> {
  const entries = new Map<string, string>();
  let section = "";
  for (const line of toml.split("\n")) {
    const head = /^\s*\[+([^\]]+)\]+/.exec(line);
    const entry = /^\s*([\w.-]+)\s*=\s*(.*?)\s*$/.exec(line);
    if (head) section = `${head[1]}.`;
    else if (entry) entries.set(section + entry[1], entry[2]!);
  }
  return entries;
}

function flattened(json: unknown, prefix = ""): [string, string][] {
  if (Array.isArray(json)) return json.flatMap((value, i) => flattened(value, `${prefix}[${i}]`));
  if (json && typeof json === "object") {
    return Object.entries(json).flatMap(([key, value]) => flattened(value, prefix ? `${prefix}.${key}` : key));
  }
  return [[prefix, typeof json === "number" && !Number.isInteger(json) ? fixed(json, 4) : String(json)]];
}

/** One row per key, one column per run; rows that differ are marked. */
function comparison(page: Page, name: string, entries: Map<string, string>[]): HTMLElement {
  const keys = [...new Set(entries.flatMap((map) => [...map.keys()]))];
  const values = (key: string) => entries.map((map) => map.get(key) ?? NONE);
  const differs = (key: string) => new Set(values(key)).size > 1;
  const rows = keys.map((key) =>
    el("tr", { class: differs(key) ? "differs" : "same" }, el("th", { scope: "row" }, key), ...values(key).map((value) => el("td", { class: "text", title: value }, value))));
  const table = el("table", { class: "comparison" },
    el("thead", {}, el("tr", {}, el("th", { scope: "col" }, "key"), ...page.runs.map((run) => el("th", { scope: "col", class: "text" }, swatch(run), run.data.name)))),
    el("tbody", {}, ...rows));
  const box = el("input", { type: "checkbox", onchange: () => table.classList.toggle("only-differences", box.checked) });
  const several = page.runs.length > 1;
  return el("details", {}, el("summary", {}, name, several ? el("span", {}, `${keys.filter(differs).length} of ${keys.length} differ`) : el("span", {}, `${keys.length} entries`)),
    several ? el("label", { class: "toggle" }, box, "differences only") : null,
    el("div", { class: "wide tall", tabindex: 0, role: "region", "aria-label": name }, table));
}

export function configuration(page: Page): HTMLElement {
  return el("div", {},
    comparison(page, "Configuration in force", page.runs.map((run) => entriesOf(run.data.config))),
    comparison(page, "Summary: inputs, models, counters", page.runs.map((run) => new Map(flattened(run.data.summary ?? {})))));
}

/** What is not on the page, and why; stretches that were not tracked. */
export function notes(page: Page): HTMLElement | null {
  const lines = [...page.data.notes];
  for (const run of page.runs) {
    const frames = run.data.bridged.reduce((sum, stretch) => sum + stretch.frames, 0);
    if (frames > 0) {
      const first = run.data.bridged[0]!;
      lines.push(`${run.data.name}: ${frames} frames not tracked, bridged in ${run.data.bridged.length} stretches; the first at ${fixed(first.distance_m, 1)} m (frame ${first.frame}: ${first.reason})`);
    }
    if (run.data.map_bytes) lines.push(`${run.data.name}: map.db holds ${bytes(run.data.map_bytes)}`);
    const refused = (run.data.evaluation?.["notes"] ?? []) as string[];
    lines.push(...refused.map((note) => `${run.data.name}: ${note}`));
  }
  return lines.length > 0 ? el("ul", { class: "notes" }, ...lines.map((line) => el("li", {}, line))) : null;
}

