// Lamps as places about the model: where their markers stand and how a drag moves them.

import { basis, rayThrough } from "./camera.js";
import { add, cross, dot, isFinite3, length, normalize, rotate, scale, sub } from "./vec.js";

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

// The place under the pointer on the sphere about the model's middle through `place`, on the same side as `place`: the
// near one where the ray enters the sphere, or the far one. Where the ray passes beside: the sphere's point nearest to it.
export function draggedOnSphere(place, model, pose, aspect, x, y) {
  const arm = sub(place, model.middle),
    r = length(arm),
    toMiddle = sub(model.middle, pose.position);
  const ray = rayThrough(pose, aspect, x, y),
    along = dot(toMiddle, ray);
  const nearest = sub(scale(ray, along), toMiddle),
    miss = length(nearest);
  if (miss >= r) return add(model.middle, scale(nearest, r / miss));
  const isNear = dot(arm, sub(place, pose.position)) < 0;
  return add(pose.position, scale(ray, along + (isNear ? -1 : 1) * Math.sqrt(r * r - miss * miss)));
}

// The place at a changed distance from the middle.
export const atDistance = (place, model, factor) =>
  add(model.middle, scale(sub(place, model.middle), factor));

// Directions from the model's middle for a new lamp, best first: towards the camera, turned to the upper right of the view
// by about 25 degrees; then less, and to its other corners.
export function directionsOfNew(model, pose) {
  const { right, up, forward } = basis(pose),
    toCamera = normalize(sub(pose.position, model.middle), scale(forward, -1));
  const corners = [
    [1, 1],
    [-1, 1],
    [1, -1],
    [-1, -1],
  ];
  return corners.flatMap(([x, y]) => {
    const aside = normalize(add(scale(right, x), scale(up, y))),
      axis = normalize(cross(toCamera, aside), right);
    return [25, 20, 15, 10, 5].map((degrees) => rotate(toCamera, axis, (degrees * Math.PI) / 180));
  });
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

// Black or white, whichever is read better on a colour as hexOfLinear() shows it [WCAG 2.2, relative luminance].
export function inkOn(rgb) {
  const most = Math.max(1, ...rgb),
    luminance = (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) / most;
  return luminance > 0.179 ? "#000000" : "#ffffff";
}
