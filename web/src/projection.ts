// What the 3-D scene and the plan map share: which keyframes can be picked, and how large uncertainty is drawn.
import type { Page, Run, Track } from "./data";
import type { Selection, State } from "./store";

export interface PickPoint extends Selection {
  x: number;
  y: number;
  z: number;
}

export const visibleRuns = (page: Page, state: State): Run[] => page.runs.filter((run) => !state.hidden.has(run.index));

/** Keyframes to click on: those with an image where there are images, else all. */
export function pickable(page: Page, state: State): PickPoint[] {
  return visibleRuns(page, state).flatMap((run) => {
    const numbers = run.views.length > 0 ? run.views.map((view) => view.keyframe) : [...run.rowOfKeyframe.keys()];
    return numbers.map((keyframe) => ({ run: run.index, keyframe, ...keyframePosition(run, keyframe) }));
  });
}

export function keyframePosition(run: Run, keyframe: number): { x: number; y: number; z: number } {
  const row = run.rowOfKeyframe.get(keyframe) ?? -1;
  const at = (name: string) => run.keyframes.column(name)[row] ?? NaN;
  return { x: at("x_m"), y: at("y_m"), z: at("z_m") };
}

/** The nearest point within `reach` of (u, v), by `project`; null where there is none. */
export function nearest(
  points: PickPoint[],
  project: (p: PickPoint) => [number, number] | null,
  [u, v]: [number, number],
  reach = 18,
): Selection | null {
  let best: PickPoint | null = null;
  let least = reach;
  for (const point of points) {
    const pixel = project(point);
    const distance = pixel ? Math.hypot(pixel[0] - u, pixel[1] - v) : Infinity;
    if (distance < least) [best, least] = [point, distance];
  }
  return best && { run: best.run, keyframe: best.keyframe };
}

/** Indices of at most `count` rows, evenly, the last one included. */
export function evenly(rows: number, count: number): number[] {
  if (rows <= count) return Array.from({ length: rows }, (_, i) => i);
  return Array.from({ length: count }, (_, i) => Math.round((i * (rows - 1)) / (count - 1)));
}

/** Rows of a track that keep every other one within `tolerance_m` of the line through them (Douglas and Peucker). */
export function simplified({ x, y, z }: Track, tolerance_m: number): number[] {
  const last = x.length - 1;
  if (last < 1) return [];
  const kept = new Uint8Array(x.length);
  kept[0] = kept[last] = 1;
  const open: [number, number][] = [[0, last]];
  for (let span = open.pop(); span; span = open.pop()) {
    const [a, b] = span;
    const [dx, dy, dz] = [x[b]! - x[a]!, y[b]! - y[a]!, z[b]! - z[a]!];
    const square = dx * dx + dy * dy + dz * dz || 1;
    let [farthest, most] = [-1, tolerance_m ** 2];
    for (let i = a + 1; i < b; ++i) {
      const [px, py, pz] = [x[i]! - x[a]!, y[i]! - y[a]!, z[i]! - z[a]!];
      const t = Math.min(1, Math.max(0, (px * dx + py * dy + pz * dz) / square));
      const distance = (px - t * dx) ** 2 + (py - t * dy) ** 2 + (pz - t * dz) ** 2;
      if (distance > most) [farthest, most] = [i, distance];
    }
    if (farthest < 0) continue;
    kept[farthest] = 1;
    open.push([a, farthest], [farthest, b]);
  }
  return Array.from(kept.keys()).filter((i) => kept[i]);
}

/** Points of the ellipse of `sigmas` standard deviations of a 2 x 2 covariance, closed. */
export function ellipse(xx: number, xy: number, yy: number, sigmas: number, points = 36): [number, number][] {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  const major = sigmas * Math.sqrt(Math.max(mean + spread, 0));
  const minor = sigmas * Math.sqrt(Math.max(mean - spread, 0));
  const angle = 0.5 * Math.atan2(2 * xy, xx - yy);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return Array.from({ length: points + 1 }, (_, i) => {
    const t = (2 * Math.PI * i) / points;
    const [a, b] = [major * Math.cos(t), minor * Math.sin(t)];
    return [c * a - s * b, s * a + c * b];
  });
}

export interface Ring {
  run: number;
  x: number;
  y: number;
  z: number;
  outline: [number, number][];
}

/** The runs' covariance ellipses, about `count` a run. */
export function rings(page: Page, state: State, count: number): Ring[] {
  return visibleRuns(page, state).flatMap((run) => {
    const column = (name: string) => run.keyframes.column(name);
    const [xx, xy, yy] = [column("cov_xx_m2"), column("cov_xy_m2"), column("cov_yy_m2")];
    return evenly(run.keyframes.rows, count)
      .filter((row) => Number.isFinite(xx[row]!))
      .map((row) => ({
        run: run.index,
        x: column("x_m")[row]!,
        y: column("y_m")[row]!,
        z: column("z_m")[row]!,
        outline: ellipse(xx[row]!, xy[row]!, yy[row]!, 3 * state.ellipseScale),
      }));
  });
}

/** Where a run was after `distance_m`; null outside its keyframes. */
export function positionAt(run: Run, distance_m: number): { x: number; y: number; z: number } | null {
  const distance = run.keyframes.column("distance_m");
  const after = distance.findIndex((d) => d >= distance_m);
  if (after < 0) return null;
  const before = Math.max(after - 1, 0);
  const span = distance[after]! - distance[before]!;
  const share = span > 0 ? (distance_m - distance[before]!) / span : 0;
  const along = (name: string) => {
    const values = run.keyframes.column(name);
    return values[before]! + share * (values[after]! - values[before]!);
  };
  return { x: along("x_m"), y: along("y_m"), z: along("z_m") };
}

/** Accepted loop closures as pairs of positions. */
export function loopLines(run: Run): [PickPoint, PickPoint][] {
  return run.data.loops
    .filter((loop) => loop.status === "accepted" && loop.keyframe !== undefined && loop.to_keyframe !== undefined)
    .map((loop) => [loop.keyframe!, loop.to_keyframe!].map((keyframe) => ({ run: run.index, keyframe, ...keyframePosition(run, keyframe) })))
    .map(([a, b]) => [a!, b!]);
}
