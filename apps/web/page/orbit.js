// Where the object is seen from: angles about its middle, as [camera.orbit] of docs/script.md has them. Positions are those
// from the middle of the object.
"use strict";
(() => {
  const { clamp } = surflect.picture;
  const radians = Math.PI / 180, steepest = 89; // degrees: at 90, the picture would spin
  const leastZoom = 1 / 10, greatestZoom = 50;
  const add = (a, b, k = 1) => a.map((x, i) => x + k * b[i]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => a.map((x) => x / Math.hypot(...a));

  // A direction of y up, turned by the shortest turn from y to another up; by half a turn about z where that is -y. The
  // program's turnFromY() [render/scene/scene.cpp], as a quaternion w, v: d + 2 v x (v x d + w d).
  function raised(d, up) {
    const [x, y, z] = up, onePlusY = y > 0 ? 1 + y : (x * x + z * z) / (1 - y); // without cancellation
    const length = Math.hypot(onePlusY, z, x);
    if (length === 0) return [-d[0], -d[1], d[2]];
    const w = onePlusY / length, v = [z / length, 0, -x / length];
    return add(d, cross(v, add(cross(v, d), d, w)), 2);
  }

  // Direction from the middle to the viewer. Azimuth 0 is on +z with y up, and grows towards +x.
  function towards({ azimuth, elevation }, up) {
    const a = azimuth * radians, e = elevation * radians;
    return raised([Math.cos(e) * Math.sin(a), Math.sin(e), Math.cos(e) * Math.cos(a)], up);
  }

  // Right, up and back of the picture, as unit vectors, and the eye. view: { azimuth, elevation, distance, target, zoom }.
  function frameOf(view, up) {
    const back = towards(view, up), right = unit(cross(up, back));
    return { right, above: cross(back, right), back, eye: add(view.target, back, view.distance) };
  }

  // Tangents of half the angle that the picture is wide and high: fovDeg is that of its shorter side before it is enlarged.
  function tangentsOf(fovDeg, aspect, zoom) {
    const half = Math.tan(fovDeg * radians / 2) / zoom;
    return aspect < 1 ? [half, half / aspect] : [half * aspect, half];
  }

  // Clip space from object space, column by column, for a ball of this radius that holds the object; as gl::clipFromCamera() has it.
  function clipFromObject(frame, [tanX, tanY], radius) {
    const along = dot(frame.eye, frame.back), far = Math.max(1e-9, (along + radius) * 1.001);
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

  // Moves what is seen by parts of the picture's height; the target stays within the ball that holds the object.
  function moved(view, up, [, tanY], dx, dy, radius) {
    const { right, above } = frameOf(view, up), height = 2 * tanY * view.distance;
    const target = add(add(view.target, right, -dx * height), above, dy * height), far = Math.hypot(...target);
    return { ...view, target: far > radius ? target.map((x) => x * radius / far) : target };
  }

  // Enlarges the picture by a factor, by a narrower field of view: the viewer never enters the object. What is seen at x, y
  // from the picture's middle, in parts of its height, stays there.
  function enlarged(view, up, tangents, factor, x, y, radius) {
    const zoom = clamp(view.zoom * factor, leastZoom, greatestZoom), share = view.zoom / zoom - 1;
    return { ...moved(view, up, tangents, share * x, share * y, radius), zoom };
  }

  // Distance along the middle of the picture to the first triangle that faces the viewer, or null
  // [Moeller, Trumbore 1997, section 2]. positions: three numbers of each vertex.
  function depthOfMiddle({ eye, back }, positions, triangles) {
    const ray = back.map((x) => -x), vertex = (i) => [positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]];
    let least = Infinity;
    for (let t = 0; t < triangles.length; t += 3) {
      const a = vertex(triangles[t]), side = add(vertex(triangles[t + 1]), a, -1), other = add(vertex(triangles[t + 2]), a, -1);
      const across = cross(ray, other), determinant = dot(side, across);
      if (!(determinant > 0)) continue;
      const from = add(eye, a, -1), u = dot(from, across), turnedFrom = cross(from, side), v = dot(ray, turnedFrom);
      if (u >= 0 && v >= 0 && u + v <= determinant) least = Math.min(least, dot(other, turnedFrom) / determinant);
    }
    return least < Infinity ? least : null;
  }

  surflect.orbit = { frameOf, tangentsOf, clipFromObject, turned, moved, enlarged, depthOfMiddle };
})();
