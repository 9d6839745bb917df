import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Page, Run, Table } from "./data";
import { el } from "./dom";
import { fixed } from "./format";
import { runColour } from "./palette";
import { visibleRuns } from "./projection";
import { decadesAround, decadesIn, LEAST_ON_LOG, rangeAround, ticksIn } from "./scales";
import type { State, Store } from "./store";

interface PlotOf {
  title: string;
  note?: string;
  unit: string;
  table: (run: Run) => Table | undefined;
  column: string;
  points?: boolean; // single values, not a curve
  zero?: boolean; // the axis begins at zero
  log?: boolean; // drawn as decimal logarithms
}

interface Group {
  title: string;
  missing: string;
  plots: PlotOf[];
}

/** Factors as the run's own graph holds them; what is drawn is the root mean square of their rows. */
const FACTOR_KINDS: [string, string, string][] = [
  ["dem_height", "DEM height factors", "in their own standard deviations"],
  ["dem_normal", "DEM normal factors", "RMS of 2 rows, in standard deviations"],
  ["terrain_patch", "Terrain patches", "RMS of the cells, in standard deviations"],
  ["prior", "Priors and terrain fixes", "RMS of 6 rows, in standard deviations"],
  ["sun", "Sun directions", "RMS of 2 rows, in standard deviations"],
  ["skyline", "Skyline", "RMS of the directions, in standard deviations"],
];

const frames = (run: Run) => run.frames;

function groupsOf(): Group[] {
  return [
    {
      title: "Error over distance",
      missing: "No ground truth was found, so there is no error to show.",
      plots: [
        { title: "Horizontal error", unit: "m", table: (run) => run.errors, column: "horizontal_m", zero: true },
        { title: "Vertical error", note: "estimate above truth is positive", unit: "m", table: (run) => run.errors, column: "vertical_m" },
      ],
    },
    {
      title: "Residuals by factor kind",
      missing: "Neither a DEM nor odometry.tum is there: no residuals.",
      plots: [
        { title: "DEM height", note: "ground contact point above the DEM, every keyframe", unit: "m", table: (run) => run.terrainResiduals, column: "height_m" },
        { title: "DEM normal", note: "body's up axis from the DEM's normal, every keyframe", unit: "\u00b0", table: (run) => run.terrainResiduals, column: "normal_deg", zero: true },
        { title: "Odometry, translation", note: "final poses against the measured step between keyframes", unit: "m", table: (run) => run.residuals["odometry"], column: "translation_m", zero: true },
        { title: "Odometry, rotation", note: "final poses against the measured step between keyframes", unit: "\u00b0", table: (run) => run.residuals["odometry"], column: "rotation_deg", zero: true },
        { title: "Odometry, chi-square", note: "6 degrees of freedom", unit: "1", table: (run) => run.residuals["odometry"], column: "chi_square", log: true },
        ...FACTOR_KINDS.map(([kind, title, note]) => ({ title, note, unit: "\u03c3", table: (run: Run) => run.residuals[kind], column: "sigmas", points: true, zero: true })),
        { title: "Loop closures, translation", unit: "m", table: (run) => run.residuals["loop"], column: "translation_m", points: true, zero: true },
        { title: "Loop closures, chi-square", note: "6 degrees of freedom", unit: "1", table: (run) => run.residuals["loop"], column: "chi_square", points: true, log: true },
      ],
    },
    {
      title: "Tracking",
      missing: "The runs wrote no frames.jsonl.",
      plots: [
        { title: "Inliers per frame", unit: "1", table: frames, column: "inliers", zero: true },
        { title: "Reprojection error, RMS", unit: "px", table: frames, column: "rms_px", zero: true },
      ],
    },
    {
      title: "Time and memory",
      missing: "The runs wrote no timings.csv.",
      plots: [
        { title: "Time per frame", note: "wall clock", unit: "ms", table: frames, column: "total_ms", zero: true },
        { title: "Memory", note: "resident set of the process", unit: "MiB", table: frames, column: "rss_mib", zero: true },
      ],
    },
  ];
}

interface Series {
  run: Run;
  x: number[];
  y: (number | null)[];
}

/** As the figure draws it: finite, or nothing. */
function drawn(value: number | undefined, log = false): number | null {
  if (value === undefined || !Number.isFinite(value)) return null;
  if (!log) return value;
  return value >= LEAST_ON_LOG ? Math.log10(value) : null;
}

/** x must grow for the plot; what stands still keeps its last value. */
function seriesOf(run: Run, plot: PlotOf): Series | null {
  const table = plot.table(run);
  if (!table || !table.names.includes(plot.column)) return null;
  const [x, y] = [table.column("distance_m"), table.column(plot.column)];
  const series: Series = { run, x: [], y: [] };
  let last = -Infinity;
  for (let i = 0; i < x.length; ++i) {
    if (!Number.isFinite(x[i])) continue;
    last = x[i]! > last ? x[i]! : last + 1e-6 * Math.max(1, Math.abs(last));
    series.x.push(last);
    series.y.push(drawn(y[i], plot.log));
  }
  return series.y.some((value) => value !== null) ? series : null;
}

/** A unit in which the values are neither tiny nor huge. */
function scaleOf(series: Series[], unit: string): [number, string] {
  if (unit !== "m") return [1, unit];
  let most = 0;
  for (const s of series) for (const value of s.y) most = Math.max(most, Math.abs(value ?? 0));
  return most > 0 && most < 0.08 ? [1000, "mm"] : [1, "m"];
}

/** The whole way, so that all figures have the same axis. */
function lengthOf(page: Page): number {
  return page.runs.reduce((most, run) => Math.max(most, run.keyframes.column("distance_m").at(-1) ?? 0, run.frames.column("distance_m").at(-1) ?? 0), 1);
}

function spanning(data: uPlot.AlignedData, length: number): uPlot.AlignedData {
  const [x, ...y] = data as unknown as [number[], ...(number | null)[][]];
  const [before, after] = [x[0]! > 0, x.at(-1)! < length];
  const padded = <T>(values: T[], first: T, last: T) => [...(before ? [first] : []), ...values, ...(after ? [last] : [])];
  return [padded(x, 0, length), ...y.map((values) => padded(values, null, null))] as uPlot.AlignedData;
}

const css = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** As many as tell all the ticks apart exactly. */
function decimalsOf(values: number[]): number {
  const exact = (decimals: number) => values.every((v) => Math.abs(v - Number(v.toFixed(decimals))) < 1e-4 * 10 ** -decimals);
  return [0, 1, 2, 3, 4, 5].find(exact) ?? 6;
}

const SUPERSCRIPTS = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";

/** 0.01, 1, 100, 10\u2077 */
function powerOfTen(exponent: number): string {
  if (Math.abs(exponent) <= 3) return fixed(10 ** exponent, Math.max(0, -exponent));
  const digits = [...String(Math.abs(exponent))].map((d) => SUPERSCRIPTS[Number(d)]).join("");
  return `10${exponent < 0 ? "\u207b" : ""}${digits}`;
}

function axis(label: string, side: 2 | 3, log = false): uPlot.Axis {
  const widthOf = (values: string[] | null) => 12 + 7 * Math.max(3, ...(values ?? []).map((text) => text.length));
  return {
    scale: side === 2 ? "x" : "y",
    label,
    labelSize: 18,
    labelFont: "12px ui-sans-serif, system-ui, sans-serif",
    font: "12px ui-sans-serif, system-ui, sans-serif",
    size: side === 2 ? 34 : (_, values) => widthOf(values),
    stroke: css("--muted"),
    grid: { stroke: css("--line"), width: 1 },
    ticks: { stroke: css("--line"), width: 1, size: 4 },
    splits: (u, _, low, high) => {
      const most = Math.max(2, Math.floor((side === 2 ? u.bbox.width / 70 : u.bbox.height / 32) / devicePixelRatio));
      return log ? decadesIn([low, high], most) : ticksIn([low, high], most);
    },
    values: (_, splits) => {
      const decimals = decimalsOf(splits);
      return splits.map((value) => (log ? powerOfTen(value) : fixed(value, decimals)));
    },
  };
}

const syncKey = "distance";

/** All figures over the distance driven; one pointer moves through all of them and along the tracks. */
export class Plots {
  readonly element = el("div", { class: "plots" });
  private plots: uPlot[] = [];
  private pending: (() => void)[] = []; // figures still to be drawn

  constructor(
    private page: Page,
    private readonly store: Store,
    private readonly onDrawn: () => void,
  ) {
    store.on((_, changed) => {
      if (changed.has("dark") || changed.has("hidden")) this.build();
    });
  }

  /** Once the element is in the document: figures are drawn a few at a time, so that the page answers meanwhile. */
  start(): void {
    new ResizeObserver(() => this.fit()).observe(this.element);
    this.build();
  }
  update(page: Page): void {
    this.page = page;
    this.build();
  }

  private build(): void {
    for (const plot of this.plots.splice(0)) plot.destroy();
    const idle = this.pending.length === 0;
    this.pending = [];
    const runs = visibleRuns(this.page, this.store.state);
    this.element.replaceChildren(...groupsOf().map((group) => this.group(group, runs)));
    if (idle) requestAnimationFrame(() => this.drawNext());
  }

  private drawNext(): void {
    const begin = performance.now();
    while (this.pending.length > 0 && performance.now() - begin < 150) this.pending.shift()!();
    if (this.pending.length > 0) requestAnimationFrame(() => this.drawNext());
    else this.onDrawn();
  }

  private group(group: Group, runs: Run[]): HTMLElement {
    const drawn = group.plots.map((plot) => this.figure(plot, runs)).filter((figure) => figure !== null);
    const hidden = runs.length === 0;
    return el("section", { class: "group" },
      el("h2", {}, group.title),
      drawn.length > 0 ? el("div", { class: `grid of-${Math.min(drawn.length, 5)}` }, ...drawn) : el("p", { class: "missing" }, hidden ? "Every run is hidden." : group.missing));
  }

  private figure(plot: PlotOf, runs: Run[]): HTMLElement | null {
    const series = runs.map((run) => seriesOf(run, plot)).filter((s): s is Series => s !== null);
    if (series.length === 0) return null;
    const [factor, unit] = scaleOf(series, plot.unit);
    const readout = el("output", { class: "readout" });
    const holder = el("div", { class: "plot", role: "img", "aria-label": `${plot.title} over distance driven, ${unit}` });
    const figure = el("figure", {},
      el("figcaption", {}, el("b", {}, plot.title), plot.note ? el("span", {}, plot.note) : null, readout),
      holder);
    this.pending.push(() => this.plots.push(this.plot(plot, unit, factor, series, readout, holder)));
    return figure;
  }

  private plot(plot: PlotOf, unit: string, factor: number, series: Series[], readout: HTMLElement, holder: HTMLElement): uPlot {
    const tables = series.map((s) => [s.x, s.y.map((value) => value && value * factor)] as uPlot.AlignedData);
    const data = spanning(tables.length === 1 ? tables[0]! : uPlot.join(tables), lengthOf(this.page));
    return new uPlot({ ...this.options(plot, unit, series, readout), width: holder.clientWidth || 300 }, data, holder);
  }

  private options(plot: PlotOf, unit: string, series: Series[], readout: HTMLElement): uPlot.Options {
    const state: State = this.store.state;
    return {
      width: 300, // replaced by what there is
      height: 210,
      legend: { show: false },
      padding: [10, 14, 0, 0],
      cursor: {
        sync: { key: syncKey, scales: ["x", null] },
        y: false,
        points: { size: 7 },
        drag: { x: true, y: false },
      },
      scales: {
        x: { time: false },
        y: { range: (_, low, high) => (plot.log ? decadesAround(low, high) : rangeAround(low, high, plot.zero ?? false)) },
      },
      axes: [axis("distance driven [m]", 2), axis(unit === "1" ? "" : `[${unit}]`, 3, plot.log)],
      series: [
        {},
        ...series.map((s) => ({
          label: s.run.data.name,
          stroke: runColour(s.run.index, state.dark),
          width: 1.5,
          points: { show: plot.points ?? false, size: 6, fill: runColour(s.run.index, state.dark) },
          paths: plot.points ? () => null : undefined,
        })),
      ] as uPlot.Series[],
      hooks: { setCursor: [(u: uPlot) => this.onCursor(u, series, unit, readout, plot.log)] },
    };
  }

  private onCursor(u: uPlot, series: Series[], unit: string, readout: HTMLElement, log = false): void {
    const index = u.cursor.idx;
    const left = u.cursor.left ?? -1;
    if (index === null || index === undefined || left < 0) {
      readout.replaceChildren();
      if (this.plots[0] === u) this.store.set({ cursor_m: null });
      return;
    }
    const at = u.data[0][index]!;
    readout.replaceChildren(
      ...series.map((s, k) => {
        const shown = nearestValue(u.data[k + 1]!, index);
        const value = log && shown !== null ? 10 ** shown : shown;
        const text = `${fixed(value, value !== null && Math.abs(value) >= 100 ? 0 : 3)}${unit === "1" ? "" : ` ${unit}`}`;
        return el("span", { style: `color:${runColour(s.run.index, this.store.state.dark)}` }, text);
      }),
    );
    if (this.plots[0] === u) this.store.set({ cursor_m: at });
  }

  private fit(): void {
    for (const plot of this.plots) {
      const width = plot.root.parentElement?.clientWidth ?? 0;
      if (width > 0 && width !== plot.width) plot.setSize({ width, height: plot.height });
    }
  }
}

/** Where runs are joined on one axis, a run has no value at another one's distance: the nearest one serves. */
function nearestValue(values: ArrayLike<number | null | undefined>, index: number): number | null {
  for (let step = 0; step < 400; ++step) {
    for (const at of [index - step, index + step]) {
      const value = values[at];
      if (value !== null && value !== undefined) return value;
    }
  }
  return null;
}
