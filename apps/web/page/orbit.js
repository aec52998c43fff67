// Where the object is seen from: angles about its middle, as [camera.orbit] of docs/script.md has them.
"use strict";
(() => {
  const { clamp } = surflect.picture;
  const radians = Math.PI / 180, steepest = 89; // degrees: at 90, the picture would spin
  const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((x) => x / Math.hypot(...a));

  // A direction of y up, turned along the shortest arc to another up.
  function raised(d, up) {
    const axis = [up[2], 0, -up[0]], cosine = up[1]; // y x up
    if (cosine < -1 + 1e-12) return [d[0], -d[1], -d[2]];
    return add(add(d.map((x) => x * cosine), cross(axis, d)), axis, dot(axis, d) / (1 + cosine));
  }

  // Direction from the middle to the viewer. Azimuth 0 is on +z with y up, and grows towards +x.
  function towards({ azimuth, elevation }, up) {
    const a = azimuth * radians, e = elevation * radians;
    return raised([Math.cos(e) * Math.sin(a), Math.sin(e), Math.cos(e) * Math.cos(a)], up);
  }

  // Right, up and back of the picture, as unit vectors, and the eye. view: { azimuth, elevation, distance, target }.
  function frameOf(view, up) {
    const back = towards(view, up), right = unit(cross(up, back));
    return { right, above: cross(back, right), back, eye: add(view.target, back, view.distance) };
  }

  // Tangents of half the angle that the picture is wide and high: fovDeg is that of its shorter side.
  function tangentsOf(fovDeg, aspect) {
    const half = Math.tan(fovDeg * radians / 2);
    return aspect < 1 ? [half, half / aspect] : [half * aspect, half];
  }

  // Clip space from object space, column by column, for a ball that holds the object; as gl::clipFromCamera() has it.
  function clipFromObject(frame, [tanX, tanY], { center, radius }) {
    const along = dot(add(frame.eye, center, -1), frame.back), far = Math.max(1e-9, (along + radius) * 1.001);
    const near = Math.max((along - radius) * 0.999, far / 1e4), depth = far - near;
    const row = (axis, scale, shift = 0) => [...axis.map((x) => x * scale), -dot(axis, frame.eye) * scale + shift];
    const rows = [row(frame.right, 1 / tanX), row(frame.above, 1 / tanY),
      row(frame.back, -(far + near) / depth, -2 * far * near / depth), row(frame.back, -1)];
    return [0, 1, 2, 3].flatMap((column) => rows.map((values) => values[column]));
  }

  function turned(view, azimuth, elevation) {
    return { ...view, azimuth: ((view.azimuth + azimuth + 180) % 360 + 360) % 360 - 180,
      elevation: clamp(view.elevation + elevation, -steepest, steepest) };
  }

  // Nearer by a factor, within a twentieth and ten times of the distance that shows the object.
  const nearer = (view, factor, home) => ({ ...view, distance: clamp(view.distance / factor, home.distance / 20, home.distance * 10) });

  // Moves what is seen by parts of the picture's height; the middle stays within the ball that holds the object.
  function moved(view, up, [, tanY], dx, dy, { center, radius }) {
    const { right, above } = frameOf(view, up), height = 2 * tanY * view.distance;
    const offset = add(add(add(view.target, right, -dx * height), above, dy * height), center, -1), far = Math.hypot(...offset);
    return { ...view, target: add(center, offset, far > radius ? radius / far : 1) };
  }

  surflect.orbit = { frameOf, tangentsOf, clipFromObject, turned, nearer, moved };
})();
