// Poses of a camera: { position, look_at, up, fov_deg } with the vertical field of view, and how they are moved.

import { add, cross, dot, length, normalize, perpendicular, rotate, scale, sub } from "./vec.js";

const radians = Math.PI / 180;

// Right, up and forward of a pose, as unit vectors.
export function basis(pose) {
  const forward = normalize(sub(pose.look_at, pose.position), [0, 1, 0]);
  const side = cross(forward, pose.up);
  const right = length(side) > 1e-6 * length(pose.up) ? normalize(side) : perpendicular(forward);
  return { right, up: cross(right, forward), forward };
}

// A point on the picture: x and y from 0 to 1 (y down), and its depth along the viewing axis.
export function project(pose, aspect, point) {
  const { right, up, forward } = basis(pose);
  const d = sub(point, pose.position),
    depth = dot(d, forward);
  const half = Math.tan((pose.fov_deg * radians) / 2),
    k = 1 / (2 * half * Math.abs(depth) || 1e-9);
  return { x: 0.5 + (dot(d, right) * k) / aspect, y: 0.5 - dot(d, up) * k, depth };
}

// Unit direction of the viewing ray through a place of the picture.
export function rayThrough(pose, aspect, x, y) {
  const { right, up, forward } = basis(pose),
    half = Math.tan((pose.fov_deg * radians) / 2);
  return normalize(
    add(forward, add(scale(right, (2 * x - 1) * half * aspect), scale(up, (1 - 2 * y) * half))),
  );
}

// The point under a place of the picture, in the plane parallel to the picture through `through`.
export function onPlaneThrough(pose, aspect, x, y, through) {
  const ray = rayThrough(pose, aspect, x, y),
    { forward } = basis(pose);
  return add(pose.position, scale(ray, dot(sub(through, pose.position), forward) / dot(ray, forward)));
}

// Turns about the point looked at: `yaw` about the scene's up, `pitch` towards it, stopping short of the poles.
export function orbited(pose, up, yaw, pitch) {
  const arm = rotate(sub(pose.position, pose.look_at), up, yaw);
  const { right } = basis({ ...pose, position: add(pose.look_at, arm), up });
  const elevation = Math.asin(Math.max(-1, Math.min(1, dot(normalize(arm), up))));
  const limit = 89 * radians;
  const turn = Math.max(-limit, Math.min(limit, elevation + pitch)) - elevation;
  return { ...pose, up, position: add(pose.look_at, rotate(arm, right, -turn)) };
}

// Shifts by parts of the picture's height, so that what is at the distance looked at follows the pointer.
export function panned(pose, dx, dy) {
  const { right, up } = basis(pose);
  const height = 2 * Math.tan((pose.fov_deg * radians) / 2) * length(sub(pose.look_at, pose.position));
  const move = add(scale(right, -dx * height), scale(up, dy * height));
  return { ...pose, position: add(pose.position, move), look_at: add(pose.look_at, move) };
}

// Changes the distance to the point looked at.
export function dollied(pose, factor) {
  return { ...pose, position: add(pose.look_at, scale(sub(pose.position, pose.look_at), factor)) };
}

// Looks around from where the camera is.
export function looked(pose, up, yaw, pitch) {
  const moved = orbited({ ...pose, position: pose.look_at, look_at: pose.position }, up, yaw, pitch);
  return { ...pose, up, look_at: moved.position };
}

// Flies by an offset in the camera's own right, up and forward.
export function flown(pose, [x, y, z]) {
  const { right, up, forward } = basis(pose);
  const move = add(add(scale(right, x), scale(up, y)), scale(forward, z));
  return { ...pose, position: add(pose.position, move), look_at: add(pose.look_at, move) };
}

// The pose of a captured camera; it looks at the point of its axis that is nearest to the model's middle.
export function poseOfCaptured(camera, model) {
  const forward = normalize(camera.forward);
  const along = Math.max(dot(sub(model.middle, camera.position), forward), 0.2 * model.radius);
  return {
    position: camera.position,
    look_at: add(camera.position, scale(forward, along)),
    up: camera.up,
    fov_deg: camera.fov_deg,
  };
}

// A pose that shows a whole model from its side.
export function poseOfModel(model) {
  const side = perpendicular(model.up),
    away = normalize(add(side, scale(model.up, 0.3)));
  return {
    position: add(model.middle, scale(away, 4.5 * model.radius)),
    look_at: [...model.middle],
    up: model.up,
    fov_deg: 30,
  };
}

// The captured camera nearest in angle about the model's middle.
export function nearestCaptured(pose, model) {
  const from = normalize(sub(pose.position, model.middle));
  let best = null,
    most = -2;
  for (const camera of model.cameras) {
    const cosine = dot(from, normalize(sub(camera.position, model.middle)));
    if (cosine > most) [best, most] = [camera, cosine];
  }
  return best;
}
