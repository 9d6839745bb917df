// Axes whose ticks and ranges are always finite and few, whatever the values are.

export type Range = [number, number];

/** Decades below this are as good as zero for what is drawn on a logarithmic axis (chi-squares). */
export const LEAST_ON_LOG = 1e-6;

/** Multiples of 1, 2 or 5 x 10^n in the range, at most `most` of them. */
export function ticksIn([low, high]: Range, most: number): number[] {
  const span = high - low;
  if (!Number.isFinite(span) || span <= 0) return [];
  const power = 10 ** Math.floor(Math.log10(span / most));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => span / s <= most) ?? span;
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.min(Math.floor(high / step + 1e-9) - first + 1, most + 1);
  return Array.from({ length: Math.max(count, 0) }, (_, i) => (first + i) * step);
}

/** Powers of ten in a range of exponents, every n-th so that there are at most `most`. */
export function decadesIn([low, high]: Range, most: number): number[] {
  const every = Math.max(1, Math.ceil((high - low) / most));
  return ticksIn([low / every, high / every], most + 1).filter(Number.isInteger).map((k) => k * every);
}

/** A little more than what there is, and never flat. */
export function rangeAround(low: number | null, high: number | null, zero: boolean): Range {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const least = zero ? Math.min(0, low) : low;
  const flat = high - least <= 1e-6 * Math.max(1e-3, Math.abs(high));
  const margin = 0.06 * (flat ? Math.max(Math.abs(high), 1e-3) : high - least);
  return [zero && least === 0 ? 0 : least - margin, high + margin];
}

/** Whole decades around exponents. */
export function decadesAround(low: number | null, high: number | null): Range {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [-1, 1];
  const least = Math.floor(low);
  return [least, Math.max(Math.ceil(high), least + 1)];
}
