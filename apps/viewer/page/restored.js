// The state that the address brings back. An address is not trusted: a state that fits neither this page nor its script is
// refused as a whole.

import { checksum, patched } from "./fragment.js";
import { cameraFields, lightFields, orbitFields, orbitOuterFields, warpFields } from "./schema.js";
import { length, isFinite3, sub } from "./vec.js";

const isObject = (x) => x !== null && typeof x === "object" && !Array.isArray(x);
const isText = (x) => typeof x === "string";
const isSwitch = (x) => typeof x === "boolean";
const isNumber =
  (least = -Infinity, most = Infinity) =>
  (x) =>
    Number.isFinite(x) && x >= least && x <= most;
const isWhole = (least, most) => (x) => Number.isInteger(x) && x >= least && x <= most;
const isFrame = isWhole(-1e6, 2e6);
const isOneOf =
  (...words) =>
  (x) =>
    words.includes(x);
const isAbsentOr = (check) => (x) => x === undefined || check(x);
const isNullOr = (check) => (x) => x === null || check(x);
const isListOf = (check) => (x) => Array.isArray(x) && x.every(check);
const isThree = (check) => (x) => Array.isArray(x) && x.length === 3 && x.every(check);
// An object whose values at these keys pass their checks; other keys are not looked at.
const isOf = (checks) => (x) => isObject(x) && Object.entries(checks).every(([key, check]) => check(x[key]));

// ---- the script

const isKey = (key) =>
  Array.isArray(key) && isNumber()(key[0]) && isNumber()(key[1]) && (key.length === 2 || key[2] === "smooth");
const isTrack = (x) =>
  isNumber()(x) ||
  isText(x) ||
  (isListOf(isKey)(x) && x.length > 0 && x.every((key, i) => i === 0 || x[i - 1][0] < key[0]));

// Whether a key of a camera, lamp or warp holds what its field edits.
function fits(spec, x) {
  const inRange = isNumber(spec.least, spec.most);
  switch (spec.kind) {
    case "vector":
    case "color":
      return isThree(isTrack)(x);
    case "fixed":
      return isThree((c) => inRange(c) && (!spec.whole || Number.isInteger(c)))(x);
    case "fixedNumber":
    case "optionalNumber":
      return inRange(x);
    case "choice":
      return spec.choices.includes(x);
    case "text":
    case "file":
      return isText(x);
    default:
      return isTrack(x);
  }
}

const isOfFields = (specs) =>
  isOf(Object.fromEntries(specs.map((spec) => [spec.key, isAbsentOr((x) => fits(spec, x))])));

const isHandle = isOf({ rest: isFinite3, to: isThree(isTrack) });
const isPoint = isOf({ at: isFinite3, move: isThree(isTrack) });
const parts = {
  light: (item) => item.type !== "environment" || isText(item.image),
  warp: isOf({ handle: isAbsentOr(isListOf(isHandle)), point: isAbsentOr(isListOf(isPoint)) }),
};

// Whether a lamp or warp is one of the script as it was saved last, or one that this page could have made. One that was
// deleted, and brought back after Save, has a place "#" in the text that the saved script lacks.
function isItem(item, part, served) {
  const fields = part === "light" ? lightFields : warpFields;
  if (!isObject(item)) return false;
  const place = item["#"],
    own = place === undefined ? undefined : served.find((other) => other["#"] === place);
  if (!isAbsentOr(isWhole(0, 9999))(place) || (own && own.type !== item.type)) return false;
  if (own && JSON.stringify(own) === JSON.stringify(item)) return true;
  return Object.hasOwn(fields, item.type) && isOfFields(fields[item.type])(item) && parts[part](item);
}

const isCamera = (x) =>
  isOf({
    from: isAbsentOr(isText),
    orbit: isAbsentOr(isOfFields(orbitFields)),
    exposure: isAbsentOr(isTrack),
  })(x) &&
  isOfFields(x.orbit ? orbitOuterFields : cameraFields)(x);

// Whether an edited [output] is that of the script, but for the tone and the colour behind it.
function isOutput(output, served) {
  if (!isObject(output) || !isObject(served)) return false;
  const isSame = (key) => JSON.stringify(output[key]) === JSON.stringify(served[key]);
  const free = { tone: isOneOf("none", "filmic"), background: isThree(isNumber(0, 1)) };
  return Object.keys({ ...served, ...output }).every((key) => isSame(key) || (free[key]?.(output[key]) ?? false));
}

// The part of an edited script that does not fit; null if all of it does.
function misfitOfDoc(doc, served) {
  if (!isObject(doc)) return "script";
  const isServed = (key) => JSON.stringify(doc[key]) === JSON.stringify(served[key]);
  for (const part of ["light", "warp"]) {
    const items = doc[part] ?? [],
      isOwn = (item) => isItem(item, part, served[part] ?? []);
    if (!isListOf(isOwn)(items)) return part;
    const places = items.map((item) => item["#"]).filter((place) => place !== undefined);
    if (new Set(places).size !== places.length) return part;
  }
  const { frames } = doc;
  if (
    !isServed("frames") &&
    !(
      isOf({ first: isFrame, last: isFrame, fps: isNumber(0.1, 1000) })(frames) && frames.first <= frames.last
    )
  )
    return "frames";
  if (!isServed("camera") && !isCamera(doc.camera)) return "camera";
  if (!isServed("output") && !isOutput(doc.output, served.output)) return "output";
  const known = ["light", "warp", "frames", "camera", "output"];
  return Object.keys({ ...served, ...doc }).find((key) => !known.includes(key) && !isServed(key)) ?? null;
}

// ---- the view

const isPose = (x) =>
  isOf({ position: isFinite3, look_at: isFinite3, up: isFinite3, fov_deg: isNumber(0.1, 179) })(x) &&
  length(sub(x.look_at, x.position)) > 0 &&
  length(x.up) > 0;

function isViewCamera(camera, model, doc) {
  if (!isObject(camera)) return false;
  switch (camera.kind) {
    case "captured":
      return model.cameras.some((c) => c.name === camera.name) || !model.cameras.length;
    case "shot":
      return model.method !== "capture" && doc.camera !== undefined;
    default:
      return camera.kind === "free" && model.method !== "capture" && isPose(camera.pose);
  }
}

// Checks by key of the view.
function viewChecks(models) {
  const isModel = isWhole(0, models.length - 1),
    isPreset = isOneOf("full", "preview"),
    isOptions = (x) => isObject(x) && Object.values(x).every((v) => isText(v) || Number.isFinite(v)),
    isWhite = isNullOr(isNumber(1e-12, 1e12));
  return {
    model: isModel,
    frame: isFrame,
    show: isText,
    light: isNullOr(isText),
    overlay: isSwitch,
    exposure: isNumber(-8, 8),
    white: isWhite,
    photographWhite: isWhite,
    tone: isOneOf("none", "filmic"),
    background: isThree(isNumber(0, 1)),
    shape: isOneOf("film", "window"),
    preset: isPreset,
    options: isOptions,
    loop: isSwitch,
    compare: isOf({
      kind: isOneOf("off", "preset", "options", "model", "photograph"),
      model: isModel,
      options: isOptions,
      preset: isPreset,
      match: isSwitch,
      split: isNumber(0, 1),
      side: isNullOr(isOneOf("a", "b")),
    }),
  };
}

// `stored` with the keys that `first` has.
const keysOf = (first, stored) => Object.fromEntries(Object.keys(first).map((key) => [key, stored[key]]));

function checkedView(stored, first, { models }, doc) {
  if (!isObject(stored)) throw new Error("view");
  for (const [key, check] of Object.entries(viewChecks(models)))
    if (!check(stored[key])) throw new Error(`view.${key}`);
  if (!isViewCamera(stored.camera, models[stored.model], doc)) throw new Error("view.camera");
  const view = { ...keysOf(first, stored), compare: keysOf(first.compare, stored.compare) };
  const { first: begin = view.frame, last: end = view.frame } = doc.frames ?? {};
  view.frame = Math.max(begin, Math.min(end, view.frame));
  return view;
}

// ---- both

const isFlag = isOf({ mute: isSwitch, solo: isSwitch });

function checkedFlags(flags, doc) {
  for (const part of ["light", "warp"])
    if (!isListOf(isFlag)(flags?.[part]) || flags[part].length !== (doc[part]?.length ?? 0))
      throw new Error(`flags.${part}`);
  return keysOf({ light: [], warp: [] }, flags);
}

function edited(doc, difference) {
  try {
    return structuredClone(patched(doc, difference));
  } catch {
    throw new Error("script");
  }
}

// { doc, flags, view, isOutdated } of a state that main.js wrote; `first` is the view at first. isOutdated: the state has
// edits of another script, which are left out, and no flags. Throws Error that names what does not fit.
export function restored(state, start, first) {
  if (!isObject(state)) throw new Error("not a state");
  if (state.c !== checksum(start.doc)) {
    const isMarked = (list) => isListOf(isFlag)(list) && list.some((flag) => flag.mute || flag.solo);
    return {
      doc: structuredClone(start.doc),
      flags: { light: [], warp: [] },
      view: checkedView(state.v, first, start, start.doc),
      isOutdated: Boolean(state.d) || ["light", "warp"].some((part) => isMarked(state.f?.[part])),
    };
  }
  const doc = edited(start.doc, state.d),
    misfit = misfitOfDoc(doc, start.doc);
  if (misfit !== null) throw new Error(misfit);
  return {
    doc,
    flags: checkedFlags(state.f, doc),
    view: checkedView(state.v, first, start, doc),
    isOutdated: false,
  };
}
