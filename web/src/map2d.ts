import type { Page, Track } from "./data";
import { groundOf } from "./data";
import { onNextFrame, surfaceOf, type Surface } from "./dom";
import { length, roundBelow } from "./format";
import { groundColour, TRUTH } from "./palette";
import { keyframePosition, loopLines, nearest, pickable, positionAt, rings, visibleRuns } from "./projection";
import type { Store } from "./store";

const CASING = "rgba(10, 11, 14, 0.85)";
const PAPER = "#3a3c42";

/** The plan: North up, metres; dragged, zoomed with wheel, pinch or + and -. */
export class PlanMap {
  private page: Page;
  private centre: [number, number] = [0, 0];
  private metresPerPixel = 0; // 0: fit
  private size: [number, number] = [1, 1]; // of the canvas when it was last drawn, CSS pixels
  private readonly redraw = onNextFrame(() => this.draw());
  private readonly pointers = new Map<number, [number, number]>();
  private moved = 0;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    page: Page,
    private shaded: HTMLCanvasElement | null,
    private readonly store: Store,
  ) {
    this.page = page;
    store.on(() => this.redraw());
    new ResizeObserver(() => this.redraw()).observe(canvas);
    this.listen();
  }

  update(page: Page): void {
    this.page = page;
    this.redraw();
  }
  setGround(shaded: HTMLCanvasElement | null): void {
    this.shaded = shaded;
    this.fit();
  }
  fit(): void {
    this.metresPerPixel = 0;
    this.redraw();
  }
  zoom(factor: number, at?: [number, number]): void {
    const [w, h] = this.size;
    const [u, v] = at ?? [w / 2, h / 2];
    const before = this.metresPerPixel;
    this.metresPerPixel = before / factor;
    this.centre[0] += (u - w / 2) * (before - this.metresPerPixel);
    this.centre[1] -= (v - h / 2) * (before - this.metresPerPixel);
    this.redraw();
  }

  private listen(): void {
    const canvas = this.canvas;
    const pixel = (event: PointerEvent | WheelEvent): [number, number] => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * 0.0015), pixel(event));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, pixel(event));
      this.moved = 0;
    });
    canvas.addEventListener("pointermove", (event) => this.drag(event.pointerId, pixel(event)));
    canvas.addEventListener("pointerup", (event) => {
      this.pointers.delete(event.pointerId);
      if (this.moved < 5) this.pick(pixel(event));
    });
    canvas.addEventListener("pointercancel", (event) => this.pointers.delete(event.pointerId));
    canvas.addEventListener("dblclick", () => this.fit());
  }

  private drag(id: number, to: [number, number]): void {
    const from = this.pointers.get(id);
    if (!from) return;
    const other = [...this.pointers].find(([pointer]) => pointer !== id)?.[1];
    this.pointers.set(id, to);
    this.moved += Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (other) {
      const spread = (p: [number, number]) => Math.hypot(p[0] - other[0], p[1] - other[1]);
      this.zoom(spread(to) / Math.max(spread(from), 1), other);
      return;
    }
    this.centre[0] -= (to[0] - from[0]) * this.metresPerPixel;
    this.centre[1] += (to[1] - from[1]) * this.metresPerPixel;
    this.redraw();
  }

  private pick(at: [number, number]): void {
    const found = nearest(pickable(this.page, this.store.state), (p) => this.pixel(p.x, p.y), at);
    if (found) this.store.set({ selected: found });
  }

  private pixel(x: number, y: number): [number, number] {
    const [w, h] = this.size;
    return [w / 2 + (x - this.centre[0]) / this.metresPerPixel, h / 2 - (y - this.centre[1]) / this.metresPerPixel];
  }

  private fitIfAsked(width: number, height: number): void {
    if (this.metresPerPixel > 0) return;
    const ground = groundOf(this.page);
    this.centre = [(ground.west + ground.east) / 2, (ground.south + ground.north) / 2];
    const fitting = Math.max((ground.east - ground.west) / (width - 90), (ground.north - ground.south) / (height - 110));
    this.metresPerPixel = Math.max(fitting, 0.005);
  }

  private draw(): void {
    const surface = surfaceOf(this.canvas);
    if (!surface) return;
    this.size = [surface.width, surface.height];
    this.fitIfAsked(surface.width, surface.height);
    const state = this.store.state;
    this.drawGround(surface);
    this.drawGraticule(surface);
    if (state.layers.ellipses) this.drawRings(surface);
    if (state.layers.truth && this.page.truth) this.drawTrack(surface, this.page.truth, TRUTH, 6);
    for (const run of visibleRuns(this.page, state)) {
      if (state.layers.odometry) this.drawTrack(surface, run.odometry, groundColour(run.index), 1.5, [5, 4]);
      this.drawTrack(surface, run.track, groundColour(run.index), 2);
      if (state.layers.loops) this.drawLoops(surface, run.index);
    }
    if (state.layers.keyframes) this.drawKeyframes(surface);
    this.drawMarkers(surface);
    this.drawScaleBar(surface);
  }

  private drawGround({ context, width, height }: Surface): void {
    context.fillStyle = PAPER;
    context.fillRect(0, 0, width, height);
    const terrain = this.page.terrain;
    if (!terrain || !this.shaded) return;
    const half = terrain.step_m / 2;
    const [u0, v0] = this.pixel(terrain.west_m - half, terrain.north_m + half);
    const size = terrain.step_m / this.metresPerPixel;
    context.imageSmoothingQuality = "high";
    context.drawImage(this.shaded, u0, v0, terrain.cols * size, terrain.rows * size);
  }

  private drawGraticule({ context, width, height }: Surface): void {
    const step = roundBelow(this.metresPerPixel * 130);
    const decimals = step < 1 ? 1 : 0;
    context.lineWidth = 1;
    context.font = "11px ui-sans-serif, system-ui, sans-serif";
    const [west, north] = [this.centre[0] - (width / 2) * this.metresPerPixel, this.centre[1] + (height / 2) * this.metresPerPixel];
    const label = (text: string, u: number, v: number) => {
      context.strokeStyle = CASING;
      context.lineWidth = 3;
      context.strokeText(text, u, v);
      context.fillStyle = "#fff";
      context.fillText(text, u, v);
      context.lineWidth = 1;
    };
    for (let x = Math.ceil(west / step) * step; this.pixel(x, 0)[0] < width; x += step) {
      const u = Math.round(this.pixel(x, 0)[0]) + 0.5;
      context.strokeStyle = "rgba(255, 255, 255, 0.14)";
      context.strokeRect(u, -2, 0, height + 4);
      context.textAlign = "center";
      if (u > 60 && u < width - 30) label(`${x.toFixed(decimals)} m E`.replace("-", "\u2212"), u, height - 8);
    }
    for (let y = Math.floor(north / step) * step; this.pixel(0, y)[1] < height; y -= step) {
      const v = Math.round(this.pixel(0, y)[1]) + 0.5;
      context.strokeStyle = "rgba(255, 255, 255, 0.14)";
      context.strokeRect(-2, v, width + 4, 0);
      context.textAlign = "left";
      if (v > 60 && v < height - 50) label(`${y.toFixed(decimals)} m N`.replace("-", "\u2212"), 8, v - 4);
    }
  }

  private drawTrack({ context }: Surface, track: Track, colour: string, width: number, dash: number[] = []): void {
    if (track.x.length === 0) return;
    const path = new Path2D();
    let last: [number, number] | null = null;
    for (let i = 0; i < track.x.length; ++i) {
      const p = this.pixel(track.x[i]!, track.y[i]!);
      if (last && Math.hypot(p[0] - last[0], p[1] - last[1]) < 0.7 && i + 1 < track.x.length) continue;
      if (last) path.lineTo(...p);
      else path.moveTo(...p);
      last = p;
    }
    context.lineJoin = "round";
    context.setLineDash(dash);
    if (dash.length === 0) {
      context.strokeStyle = CASING;
      context.lineWidth = width + 2;
      context.stroke(path);
    }
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke(path);
    context.setLineDash([]);
  }

  private drawRings({ context }: Surface): void {
    for (const ring of rings(this.page, this.store.state, 80)) {
      context.beginPath();
      for (const [dx, dy] of ring.outline) context.lineTo(...this.pixel(ring.x + dx, ring.y + dy));
      context.fillStyle = `${groundColour(ring.run)}22`;
      context.strokeStyle = groundColour(ring.run);
      context.lineWidth = 1;
      context.fill();
      context.stroke();
    }
  }

  private drawLoops({ context }: Surface, index: number): void {
    context.strokeStyle = "#fff";
    context.lineWidth = 1.5;
    for (const [a, b] of loopLines(this.page.runs[index]!)) {
      context.beginPath();
      context.moveTo(...this.pixel(a.x, a.y));
      context.lineTo(...this.pixel(b.x, b.y));
      context.stroke();
    }
  }

  private drawKeyframes({ context }: Surface): void {
    for (const point of pickable(this.page, this.store.state)) {
      const [u, v] = this.pixel(point.x, point.y);
      this.dot(context, u, v, 2.6, groundColour(point.run));
    }
  }

  private dot(context: CanvasRenderingContext2D, u: number, v: number, radius: number, colour: string): void {
    context.beginPath();
    context.arc(u, v, radius, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.strokeStyle = CASING;
    context.lineWidth = 1.2;
    context.fill();
    context.stroke();
  }

  private drawMarkers({ context }: Surface): void {
    const { selected, cursor_m } = this.store.state;
    for (const run of visibleRuns(this.page, this.store.state)) {
      const at = cursor_m === null ? null : positionAt(run, cursor_m);
      if (at) this.dot(context, ...this.pixel(at.x, at.y), 5, groundColour(run.index));
    }
    const run = selected && this.page.runs[selected.run];
    if (!run || this.store.state.hidden.has(run.index)) return;
    const at = keyframePosition(run, selected.keyframe);
    const [u, v] = this.pixel(at.x, at.y);
    const heading = run.keyframes.column("heading_rad")[run.rowOfKeyframe.get(selected.keyframe) ?? 0] ?? 0;
    this.viewCone(context, u, v, heading);
    this.dot(context, u, v, 6, "#fff");
  }

  private viewCone(context: CanvasRenderingContext2D, u: number, v: number, heading_rad: number): void {
    context.beginPath();
    context.moveTo(u, v);
    context.arc(u, v, 34, -heading_rad - 0.45, -heading_rad + 0.45);
    context.closePath();
    context.fillStyle = "rgba(255, 255, 255, 0.38)";
    context.fill();
  }

  private drawScaleBar({ context, width, height }: Surface): void {
    const metres = roundBelow(Math.min(width / 4, 160) * this.metresPerPixel);
    const pixels = metres / this.metresPerPixel;
    const [u, v] = [width - 20 - pixels, height - 30];
    for (const [colour, thickness] of [[CASING, 6], ["#fff", 3]] as const) {
      context.strokeStyle = colour;
      context.lineWidth = thickness;
      context.beginPath();
      context.moveTo(u, v);
      context.lineTo(u + pixels, v);
      context.stroke();
    }
    context.textAlign = "right";
    context.font = "12px ui-sans-serif, system-ui, sans-serif";
    context.strokeStyle = CASING;
    context.lineWidth = 3;
    context.strokeText(length(metres), width - 20, v - 8);
    context.fillStyle = "#fff";
    context.fillText(length(metres), width - 20, v - 8);
  }
}
