// Numbers as an engineer writes them: fixed decimals, true minus, thin spaces between thousands.

const MINUS = "\u2212";
const THIN_SPACE = "\u2009";
export const NONE = "\u2013";

export function fixed(value: unknown, decimals: number): string {
  if (typeof value !== "number" || !Number.isFinite(value)) return NONE;
  const [whole, rest] = Math.abs(value).toFixed(decimals).split(".") as [string, string?];
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN_SPACE) : whole;
  const isZero = Number(value.toFixed(decimals)) === 0;
  return (value < 0 && !isZero ? MINUS : "") + grouped + (rest ? `.${rest}` : "");
}

export function bytes(count: number): string {
  if (count >= 1e9) return `${fixed(count / 1e9, 2)} GB`;
  return count >= 1e6 ? `${fixed(count / 1e6, 1)} MB` : `${fixed(count / 1e3, 0)} kB`;
}

/** The largest of 1, 2, 5 x 10^n that is at most `limit`. */
export function roundBelow(limit: number): number {
  const power = 10 ** Math.floor(Math.log10(limit));
  const factor = [5, 2, 1].find((f) => f * power <= limit * 1.000001) ?? 1;
  return factor * power;
}

/** A length with a unit that fits it: 2 km, 50 m, 5 mm. */
export function length(metres: number): string {
  if (metres >= 1000) return `${metres / 1000} km`;
  if (metres >= 1) return `${metres} m`;
  return metres >= 0.01 ? `${Math.round(metres * 100)} cm` : `${Math.round(metres * 1000)} mm`;
}
