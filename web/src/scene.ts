import {
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  Group,
  LinearFilter,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Scene,
  SphereGeometry,
  SRGBColorSpace,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Line2 } from "three/examples/jsm/lines/Line2.js";
import { LineGeometry } from "three/examples/jsm/lines/LineGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import type { Page, Terrain, Track } from "./data";
import { extentOf, groundOf } from "./data";
import { onNextFrame } from "./dom";
import { groundColour, TRUTH } from "./palette";
import { keyframePosition, loopLines, nearest, pickable, positionAt, rings, simplified, visibleRuns } from "./projection";
import type { State, Store } from "./store";
import { heightAt } from "./terrain";

const DETAIL = 1 / 4000; // of the extent: how far a drawn track may be off
const CASING = "#0b0c10";
const BALL = new SphereGeometry(1, 20, 14);

/** Is there no graphics card behind WebGL? Then smooth edges cost more than they are worth. */
function drawsInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  const details = context?.getExtension("WEBGL_debug_renderer_info");
  const name = details ? String(context!.getParameter(details.UNMASKED_RENDERER_WEBGL)) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

function terrainMesh(terrain: Terrain, shaded: HTMLCanvasElement, origin: Vector3): Mesh {
  const { rows, cols, step_m, heights_m } = terrain;
  const positions = new Float32Array(rows * cols * 3);
  const uvs = new Float32Array(rows * cols * 2);
  for (let i = 0; i < rows * cols; ++i) {
    const [row, col] = [Math.floor(i / cols), i % cols];
    const height = heights_m[i]!;
    positions[3 * i] = terrain.west_m + col * step_m - origin.x;
    positions[3 * i + 1] = terrain.north_m - row * step_m - origin.y;
    positions[3 * i + 2] = (Number.isNaN(height) ? terrain.low_m : height) - origin.z;
    uvs[2 * i] = (col + 0.5) / cols;
    uvs[2 * i + 1] = 1 - (row + 0.5) / rows;
  }
  const indices: number[] = [];
  for (let row = 0; row + 1 < rows; ++row) {
    for (let col = 0; col + 1 < cols; ++col) {
      const [a, b, c, d] = [row * cols + col, row * cols + col + 1, (row + 1) * cols + col, (row + 1) * cols + col + 1];
      if (Number.isNaN(heights_m[a]! + heights_m[b]! + heights_m[c]! + heights_m[d]!)) continue;
      indices.push(a, c, b, b, c, d);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("uv", new BufferAttribute(uvs, 2));
  geometry.setIndex(indices);
  const map = new CanvasTexture(shaded);
  map.colorSpace = SRGBColorSpace;
  map.minFilter = LinearFilter;
  map.generateMipmaps = false;
  const material = new MeshBasicMaterial({ map, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  return new Mesh(geometry, material);
}

/** The runs over the terrain in space; turned, shifted and zoomed with mouse, fingers or arrow keys. */
export class SpaceScene {
  private page: Page;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(38, 1, 0.1, 1e5);
  private readonly controls: OrbitControls;
  private readonly world = new Group(); // heights are exaggerated here
  private readonly lines = new Group();
  private readonly markers = new Group();
  private readonly materials: LineMaterial[] = [];
  private ground: Mesh | null = null;
  private origin = new Vector3();
  private extent = 5; // metres
  private readonly redraw = onNextFrame(() => this.draw());

  /** Throws where the browser has no WebGL. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    page: Page,
    shaded: HTMLCanvasElement | null,
    private readonly store: Store,
    private readonly onTurn: (azimuth_rad: number) => void,
  ) {
    this.page = page;
    const antialias = !drawsInSoftware();
    this.renderer = new WebGLRenderer({ canvas, antialias, alpha: true, preserveDrawingBuffer: true });
    this.camera.up.set(0, 0, 1);
    this.world.add(this.lines, this.markers);
    this.scene.add(this.world);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = Math.PI * 0.495;
    this.controls.screenSpacePanning = false;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", this.redraw);
    this.setGround(shaded);
    this.listen();
  }

  /** The terrain of the present page, with all that is driven on it in view. */
  setGround(shaded: HTMLCanvasElement | null): void {
    const ground = groundOf(this.page);
    this.extent = Math.max(extentOf(this.page), 5);
    const [x, y] = [(ground.west + ground.east) / 2, (ground.south + ground.north) / 2];
    this.origin = new Vector3(x, y, this.groundHeight(x, y));
    this.camera.near = this.extent / 500;
    this.camera.far = this.extent * 50;
    this.camera.updateProjectionMatrix();
    if (this.ground) {
      this.world.remove(this.ground);
      this.ground.geometry.dispose();
    }
    this.ground = this.page.terrain && shaded ? terrainMesh(this.page.terrain, shaded, this.origin) : null;
    if (this.ground) this.world.add(this.ground);
    this.fit();
    this.buildLines(this.store.state);
  }

  update(page: Page): void {
    this.page = page;
    this.buildLines(this.store.state);
    this.redraw();
  }
  fit(): void {
    const aspect = this.canvas.clientWidth / Math.max(this.canvas.clientHeight, 1) || 1;
    const away = 1.35 * this.extent * Math.max(1, 1.25 / aspect);
    this.controls.target.set(0, 0, 0);
    this.camera.position.set(-0.28 * away, -0.82 * away, 0.62 * away);
    this.controls.update();
    this.redraw();
  }
  zoom(factor: number): void {
    this.camera.position.sub(this.controls.target).divideScalar(factor).add(this.controls.target);
    this.controls.update();
  }
  turn(azimuth_rad: number): void {
    this.camera.position.sub(this.controls.target).applyAxisAngle(this.camera.up, azimuth_rad).add(this.controls.target);
    this.controls.update();
  }

  private groundHeight(x: number, y: number): number {
    const height = this.page.terrain ? heightAt(this.page.terrain, x, y) : NaN;
    return Number.isNaN(height) ? (this.page.runs[0]?.track.z[0] ?? 0) : height;
  }

  private listen(): void {
    this.store.on((state, changed) => {
      if (["hidden", "layers", "ellipseScale"].some((key) => changed.has(key as keyof State))) this.buildLines(state);
      this.redraw();
    });
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    let down: [number, number] = [0, 0];
    this.canvas.addEventListener("pointerdown", (event) => (down = [event.clientX, event.clientY]));
    this.canvas.addEventListener("pointerup", (event) => {
      if (Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 5) return;
      const box = this.canvas.getBoundingClientRect();
      this.pick([event.clientX - box.left, event.clientY - box.top]);
    });
  }

  private pick(at: [number, number]): void {
    const found = nearest(pickable(this.page, this.store.state), (p) => this.pixel(p), at);
    if (found) this.store.set({ selected: found });
  }

  private pixel(p: { x: number; y: number; z: number }): [number, number] | null {
    const v = this.local(p);
    v.z *= this.store.state.exaggeration;
    v.project(this.camera);
    if (v.z > 1) return null;
    return [((v.x + 1) / 2) * this.canvas.clientWidth, ((1 - v.y) / 2) * this.canvas.clientHeight];
  }

  private local(p: { x: number; y: number; z: number }): Vector3 {
    return new Vector3(p.x, p.y, p.z).sub(this.origin);
  }

  private material(colour: string, width: number, options: { dashed?: boolean; ghost?: boolean } = {}): LineMaterial {
    const dash = this.extent / 90;
    const material = new LineMaterial({
      color: colour,
      linewidth: width,
      dashed: options.dashed ?? false,
      dashSize: dash,
      gapSize: dash * 0.7,
      depthTest: !options.ghost,
      depthWrite: false, // of lines on one another, the later one shows
      transparent: true, // drawn in their order, then
      opacity: options.ghost ? 0.6 : 1,
    });
    this.materials.push(material);
    return material;
  }

  private buildLines(state: State): void {
    this.lines.traverse((object) => {
      if (object instanceof LineSegments2) object.geometry.dispose();
    });
    this.lines.clear();
    for (const material of this.materials.splice(0)) material.dispose();
    if (state.layers.truth && this.page.truth) this.addTrack(this.page.truth, TRUTH, 5, 1);
    for (const run of visibleRuns(this.page, state)) {
      const colour = groundColour(run.index);
      const order = 10 * (run.index + 1);
      if (state.layers.odometry) this.addTrack(run.odometry, colour, 1.6, order, true);
      this.addTrack(run.track, colour, 2.2, order + 1);
      if (state.layers.loops) this.addSegments(loopLines(run).flatMap(([a, b]) => [this.local(a), this.local(b)]), "#ffffff", 1.5);
      if (state.layers.keyframes) this.addKeyframes(run.index);
    }
    if (state.layers.ellipses) this.addRings(state);
  }

  private addTrack(track: Track, colour: string, width: number, order: number, dashed = false): void {
    const rows = simplified(track, this.extent * DETAIL);
    if (rows.length < 2) return;
    const points = rows.flatMap((i) => [track.x[i]! - this.origin.x, track.y[i]! - this.origin.y, track.z[i]! - this.origin.z]);
    const geometry = new LineGeometry().setPositions(points);
    const add = (material: LineMaterial, place: number) => {
      const line = new Line2(geometry, material);
      if (dashed) line.computeLineDistances();
      line.renderOrder = place;
      this.lines.add(line);
    };
    add(this.material(colour, width, { ghost: true }), order);
    if (!dashed) add(this.material(CASING, width + 1.5), order + 0.1);
    add(this.material(colour, width, { dashed }), order + 0.2);
  }

  private addSegments(points: Vector3[], colour: string, width: number): void {
    if (points.length === 0) return;
    const geometry = new LineSegmentsGeometry().setPositions(points.flatMap((p) => p.toArray()));
    const segments = new LineSegments2(geometry, this.material(colour, width, { ghost: false }));
    segments.renderOrder = 100;
    this.lines.add(segments);
  }

  private addRings(state: State): void {
    for (const run of visibleRuns(this.page, state)) {
      const points: Vector3[] = [];
      for (const ring of rings(this.page, state, 60).filter((r) => r.run === run.index)) {
        const at = ring.outline.map(([dx, dy]) => this.local({ x: ring.x + dx, y: ring.y + dy, z: ring.z }));
        for (let i = 0; i + 1 < at.length; ++i) points.push(at[i]!, at[i + 1]!);
      }
      this.addSegments(points, groundColour(run.index), 1.2);
    }
  }

  /** Short poles, so that they can be seen and clicked whatever the distance. */
  private addKeyframes(index: number): void {
    const height = new Vector3(0, 0, this.extent / 90);
    const points = pickable(this.page, this.store.state)
      .filter((p) => p.run === index)
      .flatMap((p) => [this.local(p), this.local(p).add(height)]);
    this.addSegments(points, groundColour(index), 1.8);
  }

  private addMarker(p: { x: number; y: number; z: number }, colour: string, pixels: number): void {
    const marker = new Mesh(BALL, new MeshBasicMaterial({ color: colour, depthTest: false, transparent: true }));
    marker.position.copy(this.local(p));
    const distance = marker.position.distanceTo(this.camera.position);
    marker.scale.setScalar((distance * pixels * 2 * Math.tan((this.camera.fov * Math.PI) / 360)) / this.canvas.clientHeight);
    marker.scale.z /= this.store.state.exaggeration;
    marker.renderOrder = 200;
    this.markers.add(marker);
  }

  private placeMarkers(): void {
    this.markers.clear();
    const { selected, cursor_m, hidden } = this.store.state;
    for (const run of visibleRuns(this.page, this.store.state)) {
      const at = cursor_m === null ? null : positionAt(run, cursor_m);
      if (at) this.addMarker(at, groundColour(run.index), 5);
    }
    const run = selected && this.page.runs[selected.run];
    if (run && !hidden.has(run.index)) this.addMarker(keyframePosition(run, selected.keyframe), "#ffffff", 6);
  }

  private draw(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const size = this.renderer.getSize(new Vector2());
    if (size.x !== width || size.y !== height) {
      this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
    }
    this.world.scale.z = this.store.state.exaggeration;
    this.placeMarkers();
    this.renderer.render(this.scene, this.camera);
    this.onTurn(this.controls.getAzimuthalAngle());
  }
}
