import type { Terrain } from "./data";

const SUN_AZIMUTH = (315 * Math.PI) / 180; // from the north-west, as cartographers light a map
const SUN_ELEVATION = (38 * Math.PI) / 180;
const LOW = [104, 106, 112];
const HIGH = [214, 208, 196];
const NO_DATA = [58, 60, 66];

/** Heights' slopes by central differences, one-sided at the border and beside holes. */
function slope(at: (i: number) => number, step_m: number): number {
  const before = at(-1);
  const here = at(0);
  const after = at(1);
  if (!Number.isNaN(before) && !Number.isNaN(after)) return (after - before) / (2 * step_m);
  if (!Number.isNaN(after)) return (after - here) / step_m;
  return Number.isNaN(before) ? 0 : (here - before) / step_m;
}

/** Lambert shading, 0 to 1, of the post (row, col). */
function shade(terrain: Terrain, row: number, col: number, exaggeration: number): number {
  const { rows, cols, step_m, heights_m } = terrain;
  const height = (r: number, c: number) => (r < 0 || c < 0 || r >= rows || c >= cols ? NaN : heights_m[r * cols + c]!);
  const east = exaggeration * slope((i) => height(row, col + i), step_m);
  const north = exaggeration * slope((i) => height(row - i, col), step_m);
  const toSun = [
    Math.sin(SUN_AZIMUTH) * Math.cos(SUN_ELEVATION),
    Math.cos(SUN_AZIMUTH) * Math.cos(SUN_ELEVATION),
    Math.sin(SUN_ELEVATION),
  ] as const;
  const dot = -east * toSun[0] - north * toSun[1] + toSun[2];
  return Math.max(0, dot / Math.hypot(east, north, 1));
}

/** Gentle ground is exaggerated until its shading tells something; steep ground stays as it is. */
function exaggerationOf(terrain: Terrain): number {
  let sum = 0;
  let count = 0;
  for (let row = 1; row < terrain.rows; row += 3) {
    for (let col = 1; col < terrain.cols; col += 3) {
      const here = terrain.heights_m[row * terrain.cols + col]!;
      const west = terrain.heights_m[row * terrain.cols + col - 1]!;
      if (Number.isNaN(here) || Number.isNaN(west)) continue;
      sum += ((here - west) / terrain.step_m) ** 2;
      ++count;
    }
  }
  const rms = Math.sqrt(sum / Math.max(count, 1));
  return Math.min(6, Math.max(1, 0.22 / Math.max(rms, 1e-6)));
}

/** The terrain as a picture, a pixel per post, North up: hillshade with a slight tint by height. */
export function hillshade(terrain: Terrain): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = terrain.cols;
  canvas.height = terrain.rows;
  const context = canvas.getContext("2d")!;
  const picture = context.createImageData(terrain.cols, terrain.rows);
  const range = Math.max(65534 * terrain.height_step_m, 1e-6);
  const exaggeration = exaggerationOf(terrain);
  const level = Math.sin(SUN_ELEVATION);
  terrain.heights_m.forEach((height, i) => {
    const hole = Number.isNaN(height);
    const light = hole ? 1 : 0.36 + (0.64 * shade(terrain, Math.floor(i / terrain.cols), i % terrain.cols, exaggeration)) / level;
    const t = hole ? 0 : (height - terrain.low_m) / range;
    for (let k = 0; k < 3; ++k) {
      const tint = hole ? NO_DATA[k]! : LOW[k]! + t * (HIGH[k]! - LOW[k]!);
      picture.data[4 * i + k] = Math.min(255, tint * light);
    }
    picture.data[4 * i + 3] = 255;
  });
  context.putImageData(picture, 0, 0);
  return canvas;
}

/** The picture enlarged, with lines every `step_m` metres East and North. */
export function withGraticule(shaded: HTMLCanvasElement, terrain: Terrain, step_m: number): HTMLCanvasElement {
  const zoom = Math.max(1, Math.floor(1536 / Math.max(terrain.cols, terrain.rows)));
  const canvas = document.createElement("canvas");
  canvas.width = zoom * terrain.cols;
  canvas.height = zoom * terrain.rows;
  const context = canvas.getContext("2d")!;
  context.imageSmoothingQuality = "high";
  context.drawImage(shaded, 0, 0, canvas.width, canvas.height);
  context.fillStyle = "rgba(255, 255, 255, 0.2)";
  const east_m = terrain.west_m + terrain.cols * terrain.step_m;
  const south_m = terrain.north_m - terrain.rows * terrain.step_m;
  const pixels = (metres: number) => (metres / terrain.step_m + 0.5) * zoom;
  for (let x = Math.ceil(terrain.west_m / step_m) * step_m; x < east_m; x += step_m) {
    context.fillRect(pixels(x - terrain.west_m) - 0.75, 0, 1.5, canvas.height);
  }
  for (let y = Math.ceil(south_m / step_m) * step_m; y < terrain.north_m; y += step_m) {
    context.fillRect(0, pixels(terrain.north_m - y) - 0.75, canvas.width, 1.5);
  }
  return canvas;
}

/** Height under a map position, bilinear; NaN outside. */
export function heightAt(terrain: Terrain, x: number, y: number): number {
  const col = (x - terrain.west_m) / terrain.step_m;
  const row = (terrain.north_m - y) / terrain.step_m;
  const c = Math.floor(col);
  const r = Math.floor(row);
  if (c < 0 || r < 0 || c + 1 >= terrain.cols || r + 1 >= terrain.rows) return NaN;
  const h = (dr: number, dc: number) => terrain.heights_m[(r + dr) * terrain.cols + c + dc]!;
  const u = col - c;
  const v = row - r;
  return (1 - v) * ((1 - u) * h(0, 0) + u * h(0, 1)) + v * ((1 - u) * h(1, 0) + u * h(1, 1));
}
