import type { ImageData, Page, Run, ViewData } from "./data";
import { unpack } from "./data";
import { el, onNextFrame, surfaceOf } from "./dom";
import { fixed, NONE } from "./format";
import type { Selection, Store } from "./store";

const DEPTH = "#ffcf3f";
const NO_DEPTH = "rgba(255, 255, 255, 0.55)";
const MATCH = "#3db0ff";

interface View {
  run: Run;
  data: ViewData;
  image: ImageData;
}

/** The chosen keyframe: its image with what was seen in it, and its figures. */
export class Inspector {
  readonly element: HTMLElement;
  private readonly image = el("img", { alt: "" });
  private readonly overlay = el("canvas", { "aria-hidden": "true" });
  private readonly frame = el("div", { class: "frame" }, this.image, this.overlay);
  private readonly title = el("h3", { "aria-live": "polite" });
  private readonly caption = el("p", { class: "caption" });
  private readonly figures = el("dl", { class: "figures" });
  private readonly slider = el("input", { type: "range", min: 0, step: 1, "aria-label": "keyframe", oninput: () => this.slide() });
  private readonly features = el("input", { type: "checkbox", checked: true, onchange: () => this.redraw() });
  private readonly matches = el("input", { type: "checkbox", checked: true, onchange: () => this.redraw() });
  private readonly redraw = onNextFrame(() => this.drawOverlay());
  private view: View | null = null;

  constructor(
    private page: Page,
    private readonly store: Store,
  ) {
    const step = (by: number) => () => this.step(by);
    this.element = el(
      "section",
      { class: "inspector", "aria-label": "keyframe" },
      el(
        "div",
        { class: "inspector-head" },
        this.title,
        el("div", { class: "buttons" },
          el("button", { type: "button", id: "previous-keyframe", "aria-label": "previous keyframe", title: "previous keyframe (,)", onclick: step(-1) }, "\u2190"),
          el("button", { type: "button", id: "next-keyframe", "aria-label": "next keyframe", title: "next keyframe (.)", onclick: step(1) }, "\u2192")),
      ),
      this.slider,
      this.frame,
      el("div", { class: "toggles" },
        el("label", {}, this.features, el("i", { class: "key-dot" }), "features"),
        el("label", {}, this.matches, el("i", { class: "key-line" }), "matches")),
      this.caption,
      this.figures,
    );
    this.image.addEventListener("load", this.redraw);
    new ResizeObserver(this.redraw).observe(this.frame);
    store.on((_, changed) => {
      if (changed.has("selected")) this.show();
    });
    this.show();
  }

  update(page: Page): void {
    this.page = page;
    this.show();
  }

  /** To the next (+1) or previous (-1) keyframe that can be shown. */
  step(by: number): void {
    const selected = this.store.state.selected;
    const run = selected && this.page.runs[selected.run];
    if (!run) return;
    const numbers = this.numbers(run);
    const at = Math.max(0, numbers.indexOf(selected.keyframe)) + by;
    if (at >= 0 && at < numbers.length) this.store.set({ selected: { run: run.index, keyframe: numbers[at]! } });
  }

  private slide(): void {
    const run = this.page.runs[this.store.state.selected?.run ?? 0];
    const keyframe = run && this.numbers(run)[Number(this.slider.value)];
    if (run && keyframe !== undefined) this.store.set({ selected: { run: run.index, keyframe } });
  }

  private numbers(run: Run): number[] {
    return run.views.length > 0 ? run.views.map((view) => view.keyframe) : [...run.rowOfKeyframe.keys()];
  }

  private show(): void {
    const selected = this.store.state.selected;
    const run = selected && this.page.runs[selected.run];
    if (!run || !run.rowOfKeyframe.has(selected.keyframe)) {
      this.title.textContent = "No keyframe";
      return;
    }
    const data = run.views.find((view) => view.keyframe === selected.keyframe);
    const image = data && this.page.data.images[data.image];
    this.view = data && image ? { run, data, image } : null;
    const numbers = this.numbers(run);
    this.slider.max = String(Math.max(numbers.length - 1, 0));
    this.slider.value = String(numbers.indexOf(selected.keyframe));
    this.title.replaceChildren(`Keyframe ${selected.keyframe}`, el("small", {}, run.data.name));
    this.showImage();
    this.showFigures(run, selected);
  }

  private showImage(): void {
    this.frame.classList.toggle("empty", !this.view);
    if (!this.view) {
      this.image.removeAttribute("src");
      this.image.alt = "no image in this page";
      this.caption.textContent = "No image in this page for this keyframe.";
    } else {
      const { image, data, run } = this.view;
      this.frame.style.aspectRatio = `${image.width_px} / ${image.height_px}`;
      this.image.alt = `left image of keyframe ${data.keyframe} of ${run.data.name}, rectified`;
      this.image.src = `data:image/jpeg;base64,${image.jpeg}`;
      this.caption.textContent = captionOf(data);
    }
    this.redraw();
  }

  private showFigures(run: Run, selected: Selection): void {
    const row = run.rowOfKeyframe.get(selected.keyframe)!;
    const at = (name: string) => run.keyframes.column(name)[row] ?? NaN;
    const sigma = (name: string) => Math.sqrt(at(name));
    const heading = (90 - (at("heading_rad") * 180) / Math.PI + 720) % 360;
    const rows: [string, string, string][] = [
      ["frame", fixed(at("frame"), 0), ""],
      ["time", fixed(at("time_s"), 1), "s"],
      ["driven", fixed(at("distance_m"), 1), "m"],
      ["azimuth", fixed(heading, 1), "\u00b0"],
      ["East", fixed(at("x_m"), 2), "m"],
      ["North", fixed(at("y_m"), 2), "m"],
      ["up", fixed(at("z_m"), 2), "m"],
      ["\u03c3 East", fixed(sigma("cov_xx_m2"), 3), "m"],
      ["\u03c3 North", fixed(sigma("cov_yy_m2"), 3), "m"],
      ["\u03c3 up", fixed(sigma("cov_zz_m2"), 3), "m"],
    ];
    const height = run.terrainResiduals.rows === run.keyframes.rows ? run.terrainResiduals.column("height_m")[row] : undefined;
    if (height !== undefined) rows.push(["above DEM", fixed(height, 3), "m"]);
    const error = errorAt(run, at("distance_m"));
    if (error !== null) rows.push(["error", fixed(error, 3), "m"]);
    this.figures.replaceChildren(
      ...rows.map(([name, value, unit]) =>
        el("div", {}, el("dt", {}, name), el("dd", {}, value, value !== NONE && unit ? el("span", { class: "unit" }, ` ${unit}`) : null))),
    );
  }

  private drawOverlay(): void {
    const surface = surfaceOf(this.overlay);
    if (!surface || !this.view) return;
    const { context, width, height } = surface;
    const { image, data } = this.view;
    const place = (u: number, v: number): [number, number] => [((u / 8 + 0.5) / image.width_px) * width, ((v / 8 + 0.5) / image.height_px) * height];
    const features = data.features ? unpack(data.features) : new Uint16Array();
    const matches = data.matches ? unpack(data.matches) : new Uint16Array();
    if (this.features.checked) {
      for (let i = 0; i + 2 < features.length; i += 3) {
        context.beginPath();
        context.arc(...place(features[i]!, features[i + 1]!), 1.8, 0, 2 * Math.PI);
        context.strokeStyle = features[i + 2]! > 0 ? DEPTH : NO_DEPTH;
        context.lineWidth = 1;
        context.stroke();
      }
    }
    if (!this.matches.checked) return;
    context.strokeStyle = MATCH;
    context.lineWidth = 1.4;
    for (let i = 0; i + 2 < matches.length; i += 3) {
      const feature = 3 * matches[i]!;
      context.beginPath();
      context.moveTo(...place(matches[i + 1]!, matches[i + 2]!));
      context.lineTo(...place(features[feature]!, features[feature + 1]!));
      context.stroke();
    }
  }
}

function captionOf(view: ViewData): string {
  if (!view.features) return "Left image, rectified. The run kept no features (no map.db).";
  const features = unpack(view.features);
  const count = features.length / 3;
  const deep = Array.from({ length: count }, (_, i) => features[3 * i + 2]!).filter((d) => d > 0).length;
  const seen = view.matches ? unpack(view.matches).length / 3 : 0;
  const before = view.matched_with === undefined ? "" : `; blue: ${seen} seen in keyframe ${view.matched_with}, from where they were`;
  return `The ${count} best features, ${deep} with depth (yellow)${before}.`;
}

/** The position error at a distance driven, metres. */
function errorAt(run: Run, distance_m: number): number | null {
  const distance = run.errors.column("distance_m");
  if (distance.length === 0) return null;
  let [low, high] = [0, distance.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (distance[middle]! < distance_m) low = middle + 1;
    else high = middle;
  }
  return run.errors.column("position_m")[low] ?? null;
}
