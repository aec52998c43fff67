// Lamps as places about the model: where their markers stand and how a drag moves them.

import { basis, project, rayThrough } from "./camera.js";
import { add, dot, isFinite3, length, normalize, rotate, scale, sub } from "./vec.js";

const shell = 1.6; // radii of the model at which markers of directional lamps stand

// Where the marker of a lamp stands; `lamp` has numbers only. Null for environments.
export function markerPlace(lamp, model) {
  if (lamp.type === "point") return lamp.position;
  if (lamp.type === "directional")
    return add(model.middle, scale(normalize(lamp.direction), shell * model.radius));
  return null;
}

// The changed key of a lamp whose marker is moved to a place: position, or direction of length 1.
export function movedTo(lamp, model, place) {
  if (lamp.type === "point") return { key: "position", value: place };
  return { key: "direction", value: normalize(sub(place, model.middle)) };
}

// The place turned about the model's middle, by angles about the camera's up and right.
export function turned(place, model, pose, yaw, pitch) {
  const { right, up } = basis(pose);
  return add(model.middle, rotate(rotate(sub(place, model.middle), up, yaw), right, pitch));
}

// The place under the pointer on the sphere about the model's middle through `place`, on the same side as `place`.
// Where the ray passes beside the sphere: the sphere's point nearest to it. Null if the camera is inside of the sphere.
export function draggedOnSphere(place, model, pose, aspect, x, y) {
  const arm = sub(place, model.middle),
    r = length(arm),
    toMiddle = sub(model.middle, pose.position);
  if (length(toMiddle) <= r * 1.02) return null;
  const ray = rayThrough(pose, aspect, x, y),
    along = dot(toMiddle, ray);
  const nearest = sub(scale(ray, along), toMiddle),
    miss = length(nearest);
  if (miss >= r) return add(model.middle, scale(nearest, r / miss));
  const front = dot(arm, toMiddle) < 0;
  return add(pose.position, scale(ray, along + (front ? -1 : 1) * Math.sqrt(r * r - miss * miss)));
}

// The place at a changed distance from the middle.
export const atDistance = (place, model, factor) =>
  add(model.middle, scale(sub(place, model.middle), factor));

// Where a marker is shown on the picture: inside of its border, "out" if the place itself is not on the picture.
export function shownAt(place, pose, aspect) {
  const p = project(pose, aspect, place),
    margin = 0.03;
  if (p.depth > 0 && p.x >= 0 && p.x <= 1 && p.y >= 0 && p.y <= 1) return { x: p.x, y: p.y, out: false };
  const dx = p.x - 0.5,
    dy = p.y - 0.5;
  const k = (0.5 - margin) / Math.max(Math.abs(dx), Math.abs(dy), 1e-6);
  return { x: 0.5 + dx * k, y: 0.5 + dy * k, out: true };
}

// A captured light as a lamp of a script.
export function lampOfCaptured(light) {
  if (light.type === "directional")
    return { type: "directional", direction: [...light.direction], color: [1, 1, 1], intensity: 1 };
  const rgb = light.intensity ?? [1, 1, 1],
    most = Math.max(...rgb) || 1;
  return { type: "point", position: [...light.position], color: rgb.map((c) => c / most), intensity: most };
}

// Strength at which a new lamp about equals the capture's lights at a distance from the middle.
export function usualStrength(type, model, distance) {
  const points = model.lights.filter((light) => light.type === "point");
  if (!points.length) return type === "point" ? distance * distance : 1;
  const irradiance =
    points.reduce((sum, light) => {
      const d = length(sub(light.position, model.middle));
      return sum + Math.max(...(light.intensity ?? [1, 1, 1])) / (d * d);
    }, 0) / points.length;
  return type === "point" ? irradiance * distance * distance : irradiance;
}

// Linear light in 0..1 from and to "#rrggbb" [IEC 61966-2-1].
const toLinear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
const toDisplay = (c) => (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);

export function linearOfHex(hex) {
  return [1, 3, 5].map((i) => Number(toLinear(parseInt(hex.slice(i, i + 2), 16) / 255).toPrecision(4)));
}

// The colour of a lamp; white where it is not known yet.
export const colorOf = (lamp) => (isFinite3(lamp?.color) ? lamp.color : [1, 1, 1]);

// Colours beyond 1 are shown at full brightness.
export function hexOfLinear(rgb) {
  const most = Math.max(1, ...rgb);
  return (
    "#" +
    rgb
      .map((c) => {
        const byte = Math.round(255 * toDisplay(Math.max(0, Number.isFinite(c) ? c : 0) / most));
        return Math.min(255, byte).toString(16).padStart(2, "0");
      })
      .join("")
  );
}
