// Okabe and Ito's colours, told apart by colour-blind readers, a shade darker on light paper and lighter on dark.

const LIGHT = ["#d55e00", "#0072b2", "#008560", "#b0569a", "#a87300", "#3b8fc4"];
const DARK = ["#ff8b3d", "#56b4e9", "#2ec79a", "#e59fca", "#e9b93a", "#9bd0f2"];
/** On the terrain, which is grey in either theme. */
const GROUND = ["#ff8030", "#3db0ff", "#1fd6a0", "#ff9bd8", "#ffcf3f", "#aadcff"];

export const TRUTH = "#ffffff";

/** Of processing stages, in the order of the pipeline (Tol, bright). */
const STAGES = ["#4477aa", "#66ccee", "#228833", "#ccbb44", "#ee6677", "#aa3377", "#bbbbbb"];

const cyclic = (colours: string[], index: number): string => colours[index % colours.length]!;

export const runColour = (index: number, dark: boolean): string => cyclic(dark ? DARK : LIGHT, index);
export const groundColour = (index: number): string => cyclic(GROUND, index);
export const stageColour = (index: number): string => cyclic(STAGES, index);
