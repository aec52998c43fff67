// Numbers that move: a track is a literal, a list of keyframes [frame, value, "smooth"?], or an expression string.

export const isKeys = (track) =>
  Array.isArray(track) &&
  track.length > 0 &&
  track.every((key) => Array.isArray(key) && typeof key[0] === "number");

export function kindOf(track) {
  if (typeof track === "string") return "expression";
  return isKeys(track) ? "keys" : "literal";
}

// Value of keyframes at a frame: linear, eased by 3x^2 - 2x^3 where the segment ends at a "smooth" key, constant outside.
function valueOfKeys(keys, frame) {
  if (frame <= keys[0][0]) return keys[0][1];
  for (let i = 1; i < keys.length; ++i) {
    if (frame > keys[i][0]) continue;
    const [start, from] = keys[i - 1],
      [end, to, ease] = keys[i];
    const x = (frame - start) / (end - start);
    return from + (to - from) * (ease === "smooth" ? x * x * (3 - 2 * x) : x);
  }
  return keys[keys.length - 1][1];
}

// Value of a literal or keyframes at a frame.
export const valueAt = (track, frame) => (isKeys(track) ? valueOfKeys(track, frame) : track);

export const hasKeyAt = (track, frame) => isKeys(track) && track.some((key) => key[0] === frame);

// The track with this value at a frame. A new key takes the ease of the segment that it divides.
export function withValue(track, frame, value) {
  if (!isKeys(track)) return value;
  const keys = track.map((key) => [...key]);
  const at = keys.findIndex((key) => key[0] >= frame);
  if (at < 0) keys.push([frame, value]);
  else if (keys[at][0] === frame) keys[at][1] = value;
  else keys.splice(at, 0, [frame, value, ...(at > 0 ? keys[at].slice(2) : [])]);
  return keys;
}

export const withKey = (track, frame, value) =>
  isKeys(track) ? withValue(track, frame, value) : [[frame, value]];

// The track without its key at a frame; a literal if it was the last key.
export function withoutKey(track, frame) {
  if (!hasKeyAt(track, frame)) return track;
  const keys = track.filter((key) => key[0] !== frame);
  return keys.length ? keys : track[0][1];
}

// The track with its key at `from` moved to frame `to`; a key that was there is replaced.
export function withKeyMoved(track, from, to) {
  const key = isKeys(track) && track.find((k) => k[0] === from);
  if (!key || from === to) return track;
  const rest = track.filter((k) => k[0] !== from && k[0] !== to);
  return [...rest, [to, ...key.slice(1)]].sort((a, b) => a[0] - b[0]);
}

// Whether the segment that ends at a frame's key is eased; the same track with that switched.
export const isSmoothAt = (track, frame) =>
  isKeys(track) && track.some((k) => k[0] === frame && k[2] === "smooth");
export const withSmoothSwitched = (track, frame) =>
  track.map((k) => (k[0] !== frame ? k : k[2] === "smooth" ? k.slice(0, 2) : [k[0], k[1], "smooth"]));

const textKeys = new Set([
  "type",
  "image",
  "mapping",
  "uncovered",
  "from",
  "frames",
  "file",
  "animation",
  "x",
  "y",
  "z",
]);

// Calls visit(track, path) for every track of cameras, lights and warps in `doc`.
export function eachTrack(doc, visit) {
  const walk = (value, path) => {
    const key = path[path.length - 1];
    if (typeof value === "number" || isKeys(value)) visit(value, path);
    else if (typeof value === "string") {
      if (!textKeys.has(key) && key !== "rest") visit(value, path);
    } else if (Array.isArray(value)) value.forEach((item, i) => walk(item, [...path, i]));
    else if (value && typeof value === "object")
      for (const name of Object.keys(value)) if (name !== "#") walk(value[name], [...path, name]);
  };
  for (const part of ["camera", "light", "warp"]) walk(doc[part], [part]);
}

export function getIn(value, path) {
  for (const key of path) value = value?.[key];
  return value;
}

export function setIn(value, path, item) {
  const last = path.length - 1;
  for (let i = 0; i < last; ++i) value = value[path[i]] ??= typeof path[i + 1] === "number" ? [] : {};
  if (item === undefined) delete value[path[last]];
  else value[path[last]] = item;
}

// Frames with keys, in rising order: Map of frame to the paths of the tracks that have a key there.
export function keyFrames(doc) {
  const frames = new Map();
  eachTrack(doc, (track, path) => {
    if (isKeys(track)) for (const [frame] of track) frames.set(frame, [...(frames.get(frame) ?? []), path]);
  });
  return new Map([...frames].sort((a, b) => a[0] - b[0]));
}

// What a typed text means: { value } a number, { expression } a formula, or { error }.
export function parseTyped(text, mayMove, { least, most, whole } = {}) {
  const trimmed = text.trim();
  if (trimmed === "") return { error: "a number is missing" };
  const value = Number(trimmed);
  if (Number.isFinite(value)) {
    if (whole && !Number.isInteger(value)) return { error: "expected a whole number" };
    if (least !== undefined && value < least) return { error: `expected ${least} or more` };
    if (most !== undefined && value > most) return { error: `expected ${most} or less` };
    return { value };
  }
  if (!mayMove || value === Infinity || value === -Infinity) return { error: "expected a finite number" };
  const names = trimmed.match(/[A-Za-z_]\w*/g) ?? [];
  if (names.some((name) => /^(nan|inf|infinity)$/i.test(name))) return { error: "expected a finite number" };
  if (!/^[\w+\-*/^().,?:<>=!&| ]+$/.test(trimmed) || !/[\w)]$/.test(trimmed))
    return { error: "expected a number or a formula of t, frame and s" };
  let depth = 0;
  for (const c of trimmed) if ((depth += c === "(" ? 1 : c === ")" ? -1 : 0) < 0) break;
  return depth === 0 ? { expression: trimmed } : { error: "brackets do not match" };
}
