// What a page is given (docs/report.md), and its arrays unpacked.

export type Packed = { f32: string } | { u16: string };
export type PackedTable = Record<string, Packed>;

export interface TerrainData {
  file: string;
  rows: number;
  cols: number;
  step_m: number;
  west_m: number;
  north_m: number;
  low_m: number;
  height_step_m: number;
  heights: Packed;
}

export interface LoopData {
  frame: number;
  distance_m: number;
  status: string;
  inliers: number;
  reason?: string;
  keyframe?: number;
  to_keyframe?: number;
  to_distance_m?: number;
}

export interface BridgedData {
  frame: number;
  frames: number;
  distance_m: number;
  reason: string;
}

export interface ViewData {
  keyframe: number;
  image: number;
  features?: Packed;
  matches?: Packed;
  matched_with?: number;
}

export interface ImageData {
  width_px: number;
  height_px: number;
  jpeg: string;
}

export interface StageStatistics {
  mean: number;
  median: number;
  p95: number;
  max: number;
}

export interface RunData {
  name: string;
  summary: Record<string, unknown> | null;
  config: string;
  evaluation: Record<string, unknown> | null;
  distance_along: string;
  track: PackedTable;
  odometry: PackedTable;
  frames: PackedTable;
  keyframes: PackedTable;
  errors?: PackedTable;
  residuals: Record<string, PackedTable>;
  terrain_residuals?: PackedTable;
  loops: LoopData[];
  bridged: BridgedData[];
  timings: Record<string, StageStatistics>;
  views?: ViewData[];
  map_bytes?: number;
}

export interface PageData {
  demslam: string;
  live?: string;
  terrain: TerrainData | null;
  truth: PackedTable | null;
  runs: RunData[];
  images: ImageData[];
  notes: string[];
}

function bytesOf(base64: string): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

export function unpack(packed: Packed): Float32Array | Uint16Array {
  if ("f32" in packed) return new Float32Array(bytesOf(packed.f32).buffer);
  return new Uint16Array(bytesOf(packed.u16).buffer);
}

/** Columns of equal length; a missing column is empty. Each is unpacked when it is first asked for. */
export class Table {
  private readonly columns = new Map<string, Float32Array>();
  constructor(private readonly packed: PackedTable | null | undefined) {}

  get names(): string[] {
    return Object.keys(this.packed ?? {});
  }
  column(name: string): Float32Array {
    const known = this.columns.get(name);
    if (known) return known;
    const packed = this.packed?.[name];
    const values = packed ? Float32Array.from(unpack(packed)) : new Float32Array();
    this.columns.set(name, values);
    return values;
  }
  get rows(): number {
    const first = this.names[0];
    return first ? this.column(first).length : 0;
  }
}

/** Positions in the map frame: East, North, up. */
export interface Track {
  x: Float32Array;
  y: Float32Array;
  z: Float32Array;
}

function trackOf(packed: PackedTable | null): Track {
  const table = new Table(packed);
  return { x: table.column("x_m"), y: table.column("y_m"), z: table.column("z_m") };
}

export interface Terrain extends Omit<TerrainData, "heights"> {
  heights_m: Float32Array; // NaN: no data
}

export interface Run {
  index: number;
  data: RunData;
  track: Track;
  odometry: Track;
  frames: Table;
  keyframes: Table;
  errors: Table;
  residuals: Record<string, Table>;
  terrainResiduals: Table;
  views: ViewData[];
  rowOfKeyframe: Map<number, number>;
}

export interface Page {
  data: PageData;
  terrain: Terrain | null;
  truth: Track | null;
  runs: Run[];
}

function terrainOf(data: TerrainData): Terrain {
  const steps = unpack(data.heights);
  const heights_m = Float32Array.from(steps, (s) => (s === 65535 ? NaN : data.low_m + s * data.height_step_m));
  return { ...data, heights_m };
}

function runOf(data: RunData, index: number): Run {
  const keyframes = new Table(data.keyframes);
  const rowOfKeyframe = new Map<number, number>();
  keyframes.column("number").forEach((number, row) => rowOfKeyframe.set(number, row));
  return {
    index,
    data,
    track: trackOf(data.track),
    odometry: trackOf(data.odometry),
    frames: new Table(data.frames),
    keyframes,
    errors: new Table(data.errors),
    residuals: Object.fromEntries(Object.entries(data.residuals ?? {}).map(([kind, t]) => [kind, new Table(t)])),
    terrainResiduals: new Table(data.terrain_residuals),
    views: (data.views ?? []).filter((view) => rowOfKeyframe.has(view.keyframe)),
    rowOfKeyframe,
  };
}

export function pageOf(data: PageData): Page {
  return {
    data,
    terrain: data.terrain ? terrainOf(data.terrain) : null,
    truth: data.truth ? trackOf(data.truth) : null,
    runs: (data.runs ?? []).map(runOf),
  };
}

/** The box around everything driven, metres. */
export interface Ground {
  west: number;
  east: number;
  south: number;
  north: number;
}

/** Do two pages show the same piece of terrain? */
export function sameTerrain(a: Terrain | null, b: Terrain | null): boolean {
  if (!a || !b) return a === b;
  return a.west_m === b.west_m && a.north_m === b.north_m && a.rows === b.rows && a.cols === b.cols && a.step_m === b.step_m;
}

export function groundOf(page: Page): Ground {
  const ground = { west: Infinity, east: -Infinity, south: Infinity, north: -Infinity };
  const tracks = page.runs.flatMap((run) => [run.track, run.odometry]);
  if (page.truth) tracks.push(page.truth);
  for (const track of tracks) {
    for (let i = 0; i < track.x.length; ++i) {
      ground.west = Math.min(ground.west, track.x[i]!);
      ground.east = Math.max(ground.east, track.x[i]!);
      ground.south = Math.min(ground.south, track.y[i]!);
      ground.north = Math.max(ground.north, track.y[i]!);
    }
  }
  return ground.west <= ground.east ? ground : { west: -10, east: 10, south: -10, north: 10 };
}

/** The longer side of that box, metres. */
export function extentOf(page: Page): number {
  const ground = groundOf(page);
  return Math.max(ground.east - ground.west, ground.north - ground.south);
}
