// Keys of cameras, lights and warps in a script: their kind, default and the range of their slider.
// kind: "number" and "vector" move; "fixed" is a vector of literals; "text" and "file" are strings; "choice" is a list.
// range: [least, most] of the slider, "place" for coordinates and "size" for lengths, both by the model's radius.

const angle = { kind: "number", standard: 0, range: [-180, 180] };
const center = { key: "center", kind: "vector", standard: [0, 0, 0], range: "place" };
const axis = { key: "axis", kind: "vector", standard: [0, 1, 0], range: [-1, 1] };
const direction = { key: "direction", kind: "vector", standard: [1, 0, 0], range: [-1, 1] };
const stretch = { key: "length", kind: "number", standard: 1, range: "size", least: 0 };
const angleDeg = { ...angle, key: "angle_deg" };
const up = { key: "up", kind: "vector", standard: [0, 1, 0], range: [-1, 1] };
const fov = { key: "fov_deg", kind: "number", standard: 30, range: [5, 120], least: 0.1, most: 179 };

export const cameraFields = [
  { key: "position", kind: "vector", standard: [0, 0, 1], range: "place" },
  { key: "look_at", kind: "vector", standard: [0, 0, 0], range: "place" },
  up,
  fov,
];
export const orbitFields = [
  { key: "center", kind: "vector", standard: [0, 0, 0], range: "place" },
  { key: "radius", kind: "number", standard: 1, range: "size", least: 0 },
  { ...angle, key: "azimuth_deg" },
  { ...angle, key: "elevation_deg", range: [-90, 90] },
];
export const orbitOuterFields = [up, fov];

const intensity = { key: "intensity", kind: "number", standard: 1, range: "strength", least: 0, log: true };
const color = { key: "color", kind: "color", standard: [1, 1, 1] };
const uncovered = {
  key: "uncovered",
  kind: "choice",
  choices: ["", "extrapolate", "fade"],
  names: { "": "as usual" },
  standard: "",
};

export const lightFields = {
  point: [
    color,
    intensity,
    { key: "position", kind: "vector", standard: [0, 0, 1], range: "place" },
    uncovered,
  ],
  directional: [
    color,
    intensity,
    { key: "direction", kind: "vector", standard: [0, 0, 1], range: [-1, 1] },
    uncovered,
  ],
  environment: [
    { key: "rotate_deg", kind: "number", standard: 0, range: [-180, 180] },
    intensity,
    color,
    { ...up, standard: [0, 1, 0] },
    {
      key: "mapping",
      kind: "choice",
      choices: ["", "latlong", "angular", "mirror_ball"],
      names: { "": "by shape", latlong: "lat-long", mirror_ball: "mirror ball" },
      standard: "",
    },
    {
      key: "error",
      kind: "fixedNumber",
      standard: 0.01,
      range: [0.001, 0.5],
      least: 0.0001,
      most: 1,
      log: true,
    },
    uncovered,
  ],
};

// The numbers that say how much a warp does come first.
export const warpFields = {
  rigid: [angleDeg, { key: "translate", kind: "vector", standard: [0, 0, 0], range: "place" }, axis, center],
  scale: [{ key: "factor", kind: "vector", standard: [1, 1, 1], range: [-2, 3] }, center],
  twist: [angleDeg, stretch, axis, center],
  bend: [angleDeg, stretch, axis, direction, center],
  taper: [
    { key: "factor", kind: "number", standard: 1, range: [0.1, 10], least: 0.001, log: true },
    axis,
    center,
    stretch,
  ],
  sine: [
    { key: "amplitude", kind: "number", standard: 0, range: "small" },
    { key: "wavelength", kind: "number", standard: 1, range: "size", least: 0 },
    { ...angle, key: "phase_deg" },
    axis,
    direction,
    center,
  ],
  expression: ["x", "y", "z"].map((key) => ({ key, kind: "text", standard: key })),
  lattice: [
    { key: "min", kind: "fixed", standard: [-1, -1, -1], range: "place" },
    { key: "max", kind: "fixed", standard: [1, 1, 1], range: "place" },
    { key: "divisions", kind: "fixed", standard: [1, 1, 1], range: [1, 16], whole: true, least: 1, most: 16 },
  ],
  handles: [{ key: "radius", kind: "optionalNumber", range: "size", least: 0 }],
  mesh: [
    { key: "rest", kind: "file" },
    { key: "frames", kind: "file" },
    { key: "frame", kind: "number", standard: "frame", range: "frames" },
  ],
  skeleton: [
    { key: "file", kind: "file" },
    { key: "animation", kind: "file" },
    { key: "time", kind: "number", standard: "t", range: [0, 10] },
  ],
};

// A new warp for a model with this middle, radius and up. Those of one amount do a little at once, so that they are seen.
export function newWarp(type, { middle, radius, up: upwards }) {
  const round = (v) => v.map((x) => Number(x.toPrecision(4)));
  const side = Math.abs(upwards[0]) > 0.7 ? [0, 1, 0] : [1, 0, 0];
  const foot = round(middle.map((m, i) => m - radius * upwards[i]));
  const base = { type },
    height = Number((2 * radius).toPrecision(3));
  switch (type) {
    case "rigid":
      return { ...base, axis: round(upwards), angle_deg: 0, center: round(middle), translate: [0, 0, 0] };
    case "scale":
      return { ...base, factor: [1.15, 1, 0.9], center: round(middle) };
    case "twist":
      return {
        ...base,
        axis: round(upwards),
        angle_deg: 30,
        center: foot,
        length: height,
      };
    case "bend":
      return {
        ...base,
        axis: round(upwards),
        direction: side,
        angle_deg: 30,
        center: foot,
        length: height,
      };
    case "taper":
      return {
        ...base,
        axis: round(upwards),
        factor: 0.7,
        center: foot,
        length: height,
      };
    case "sine":
      return {
        ...base,
        axis: round(upwards),
        direction: side,
        amplitude: Number((0.05 * radius).toPrecision(3)),
        wavelength: Number(radius.toPrecision(3)),
        center: foot,
      };
    case "expression":
      return { ...base, x: "x", y: "y", z: "z" };
    case "lattice":
      return {
        ...base,
        min: round(middle.map((m) => m - radius)),
        max: round(middle.map((m) => m + radius)),
        divisions: [2, 2, 2],
        point: [],
      };
    default:
      return base;
  }
}

// Range of a field's slider, for a model of this radius.
export function sliderRange(spec, model, frames) {
  const r = model.radius;
  if (Array.isArray(spec.range)) return spec.range;
  switch (spec.range) {
    case "place":
      return [-4 * r, 4 * r];
    case "size":
      return [0, 6 * r];
    case "small":
      return [-r, r];
    case "strength":
      return [0.01, 1000];
    case "frames":
      return [frames.first, frames.last];
    default:
      return [0, 1];
  }
}
