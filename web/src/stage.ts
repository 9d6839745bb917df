import type { Page } from "./data";
import { extentOf, sameTerrain } from "./data";
import { el } from "./dom";
import { length, roundBelow } from "./format";
import { TRUTH } from "./palette";
import { PlanMap } from "./map2d";
import { SpaceScene } from "./scene";
import type { Layers, Store } from "./store";
import { hillshade, withGraticule } from "./terrain";

type Mode = "space" | "plan";

const LAYER_NAMES: Record<keyof Layers, string> = {
  truth: "truth",
  odometry: "odometry (dashed)",
  ellipses: "3\u03c3 ellipses",
  loops: "loop closures",
  keyframes: "keyframes",
};

/** The picture of the ground with the tracks on it, in space or as a plan, and what is to be drawn in it. */
export class Stage {
  readonly element: HTMLElement;
  private readonly spaceCanvas = el("canvas", { id: "space", tabindex: 0, role: "img", "aria-label": "tracks over the terrain in space; arrow keys turn, plus and minus zoom" });
  private readonly planCanvas = el("canvas", { id: "plan", tabindex: 0, role: "img", "aria-label": "plan of the tracks, North up; plus and minus zoom" });
  private readonly compass = el("div", { class: "compass", "aria-hidden": "true" }, el("span", {}, "N"));
  private readonly scale = el("p", { class: "stage-scale" });
  private readonly message = el("p", { class: "stage-message", role: "status" });
  private readonly tabs: Record<Mode, HTMLButtonElement>;
  private space: SpaceScene | null = null;
  private plan: PlanMap | null = null;
  private mode: Mode = "space";
  private extent_m = 0;

  constructor(
    private page: Page,
    private readonly store: Store,
  ) {
    const tab = (mode: Mode, name: string) =>
      el("button", { type: "button", role: "tab", id: `tab-${mode}`, "aria-selected": "false", onclick: () => this.show(mode) }, name);
    this.tabs = { space: tab("space", "3-D"), plan: tab("plan", "Map") };
    this.element = el("section", { class: "stage", "aria-label": "terrain and tracks" },
      el("div", { class: "picture" }, this.spaceCanvas, this.planCanvas, this.compass, this.scale, this.message,
        el("div", { class: "tabs", role: "tablist", "aria-label": "view" }, this.tabs.space, this.tabs.plan),
        el("div", { class: "zoom" },
          this.button("+", "zoom in", () => this.zoom(1.4)),
          this.button("\u2212", "zoom out", () => this.zoom(1 / 1.4)),
          this.button("\u2922", "show everything", () => this.fit()))),
      this.controls());
    for (const canvas of [this.spaceCanvas, this.planCanvas]) canvas.addEventListener("keydown", (event) => this.onKey(event));
  }

  /** Once the element is in the document. */
  start(): void {
    const shaded = this.shaded();
    this.plan = new PlanMap(this.planCanvas, this.page, shaded, this.store);
    try {
      this.space = new SpaceScene(this.spaceCanvas, this.page, this.lined(shaded), this.store, (azimuth) => this.turnCompass(azimuth));
    } catch {
      this.message.textContent = "This browser has no WebGL: the plan is shown instead of the 3-D view.";
      this.tabs.space.disabled = true;
    }
    this.show(this.space ? "space" : "plan");
  }

  /** Everything is shown anew where the run has left the ground drawn so far. */
  update(page: Page): void {
    const moved = !sameTerrain(page.terrain, this.page.terrain) || extentOf(page) > 2 * this.extent_m;
    this.page = page;
    this.space?.update(page);
    this.plan?.update(page);
    if (!moved) return;
    const shaded = this.shaded();
    this.space?.setGround(this.lined(shaded));
    this.plan?.setGround(shaded);
  }

  private shaded(): HTMLCanvasElement | null {
    this.extent_m = extentOf(this.page);
    return this.page.terrain ? hillshade(this.page.terrain) : null;
  }

  private lined(shaded: HTMLCanvasElement | null): HTMLCanvasElement | null {
    const step_m = roundBelow(Math.max(this.extent_m, 1) / 4);
    this.scale.textContent = shaded ? `grid ${length(step_m)}` : "";
    return shaded && withGraticule(shaded, this.page.terrain!, step_m);
  }

  private button(text: string, name: string, action: () => void): HTMLButtonElement {
    return el("button", { type: "button", "aria-label": name, title: name, onclick: action }, text);
  }

  private show(mode: Mode): void {
    this.mode = mode;
    this.element.dataset["mode"] = mode;
    for (const [name, tab] of Object.entries(this.tabs)) tab.setAttribute("aria-selected", String(name === mode));
    if (mode === "plan") this.turnCompass(0);
  }

  private zoom(factor: number): void {
    if (this.mode === "space") this.space?.zoom(factor);
    else this.plan?.zoom(factor);
  }
  private fit(): void {
    if (this.mode === "space") this.space?.fit();
    else this.plan?.fit();
  }

  private onKey(event: KeyboardEvent): void {
    const actions: Record<string, () => void> = {
      "+": () => this.zoom(1.25),
      "-": () => this.zoom(0.8),
      "0": () => this.fit(),
      ArrowLeft: () => this.space?.turn(-0.12),
      ArrowRight: () => this.space?.turn(0.12),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private turnCompass(azimuth_rad: number): void {
    this.compass.style.transform = `rotate(${azimuth_rad}rad)`;
  }

  private controls(): HTMLElement {
    const { layers } = this.store.state;
    const available: (keyof Layers)[] = ["truth", "odometry", "ellipses", "loops", "keyframes"];
    const exists: Partial<Record<keyof Layers, boolean>> = {
      truth: this.page.truth !== null,
      loops: this.page.runs.some((run) => run.data.loops.some((loop) => loop.status === "accepted")),
      odometry: this.page.runs.some((run) => run.odometry.x.length > 0),
    };
    const layer = (name: keyof Layers) => {
      const box = el("input", { type: "checkbox", checked: layers[name], onchange: () => this.store.set({ layers: { ...this.store.state.layers, [name]: box.checked } }) });
      return el("label", {}, box, name === "truth" ? el("i", { class: "swatch truth", style: `--run:${TRUTH}` }) : null, LAYER_NAMES[name]);
    };
    const choice = (name: string, values: number[], set: (value: number) => void) => {
      const select = el("select", { "aria-label": name, onchange: () => set(Number(select.value)) }, ...values.map((value) => el("option", { value }, `\u00d7${value}`)));
      return el("label", {}, name, select);
    };
    return el("div", { class: "controls" },
      ...available.filter((name) => this.page.data.live || exists[name] !== false).map(layer),
      choice("ellipse size", [1, 5, 20, 100], (ellipseScale) => this.store.set({ ellipseScale })),
      choice("heights", [1, 2, 5], (exaggeration) => this.store.set({ exaggeration })));
  }
}
