// Where markers of places outside of the picture stand: along its border, clear of the controls and of each other.

const reach = 14; // pixels from a marker's middle to its border
const margin = 22;
const step = 4;

const isIn = ({ left, top, right, bottom }, x, y) =>
  x > left - reach && x < right + reach && y > top - reach && y < bottom + reach;

// Whether a marker at a place would lie on one of the boxes or on a marker at `taken`. All in pixels.
export const isFree = (x, y, boxes, taken) =>
  boxes.every((box) => !isIn(box, x, y)) &&
  taken.every((other) => Math.hypot(other.x - x, other.y - y) >= 2 * reach);

// The point of the border's frame after `way` pixels clockwise from its upper left corner.
function onFrame(way, width, height) {
  const w = Math.max(1, width - 2 * margin),
    h = Math.max(1, height - 2 * margin),
    round = 2 * (w + h),
    at = ((way % round) + round) % round;
  const [x, y] =
    at < w
      ? [at, 0]
      : at < w + h
        ? [w, at - w]
        : at < 2 * w + h
          ? [2 * w + h - at, h]
          : [0, round - at];
  return { x: margin + x, y: margin + y };
}

// Way along the frame to where the ray from the picture's middle along (dx, dy) meets it.
function wayAlong(dx, dy, width, height) {
  const w = Math.max(1, width - 2 * margin),
    h = Math.max(1, height - 2 * margin),
    k = Math.min(w / 2 / Math.max(Math.abs(dx), 1e-9), h / 2 / Math.max(Math.abs(dy), 1e-9)),
    x = w / 2 + dx * k,
    y = h / 2 + dy * k;
  if (y <= 1e-6) return x;
  if (x >= w - 1e-6) return w + y;
  return y >= h - 1e-6 ? 2 * w + h - x : 2 * (w + h) - y;
}

// The free place of the border nearest, along it, to where a place in the direction (dx, dy) leaves the picture.
export function borderPlace(dx, dy, width, height, boxes, taken) {
  const way = wayAlong(dx, dy, width, height);
  for (let off = 0; off <= width + height; off += step)
    for (const sign of [1, -1]) {
      const { x, y } = onFrame(way + sign * off, width, height);
      if (isFree(x, y, boxes, taken)) return { x, y };
    }
  return onFrame(way, width, height);
}
