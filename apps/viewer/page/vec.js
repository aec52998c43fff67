// Vectors of three numbers, as arrays.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, k) => [a[0] * k, a[1] * k, a[2] * k];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);
export const isFinite3 = (a) => Array.isArray(a) && a.length === 3 && a.every(Number.isFinite);

// `a` at length 1; `fallback` if `a` has no direction.
export function normalize(a, fallback = [0, 0, 1]) {
  const l = length(a);
  return l > 1e-12 && Number.isFinite(l) ? scale(a, 1 / l) : fallback;
}

// A unit vector perpendicular to `a`.
export function perpendicular(a) {
  const other = Math.abs(a[0]) < 0.7 * length(a) ? [1, 0, 0] : [0, 1, 0];
  return normalize(cross(a, other));
}

// `a` rotated by `angle` radians about a unit axis, counter-clockwise seen from its tip [Rodrigues 1840].
export function rotate(a, axis, angle) {
  const c = Math.cos(angle),
    s = Math.sin(angle);
  return add(add(scale(a, c), scale(cross(axis, a), s)), scale(axis, dot(axis, a) * (1 - c)));
}

// Rounds to `digits` significant digits, so that scripts stay readable.
export const tidy = (x, digits = 5) => (Number.isFinite(x) ? Number(x.toPrecision(digits)) : x);
export const tidy3 = (a, digits) => a.map((x) => tidy(x, digits));
