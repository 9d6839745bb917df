// What the reader has chosen; everything on the page listens to it.

export interface Selection {
  run: number;
  keyframe: number;
}

export interface Layers {
  truth: boolean;
  odometry: boolean;
  ellipses: boolean;
  loops: boolean;
  keyframes: boolean;
}

export interface State {
  dark: boolean;
  hidden: ReadonlySet<number>; // runs
  selected: Selection | null;
  cursor_m: number | null; // distance driven under the pointer
  layers: Layers;
  exaggeration: number; // of heights
  ellipseScale: number; // of three sigma
}

type Listener = (state: State, changed: ReadonlySet<keyof State>) => void;

export class Store {
  private readonly listeners: Listener[] = [];
  constructor(public state: State) {}

  on(listener: Listener): void {
    this.listeners.push(listener);
  }
  set(patch: Partial<State>): void {
    const keys = (Object.keys(patch) as (keyof State)[]).filter((key) => patch[key] !== this.state[key]);
    if (keys.length === 0) return;
    this.state = { ...this.state, ...patch };
    const changed = new Set(keys);
    for (const listener of this.listeners) listener(this.state, changed);
  }
}
