// The weights of planes under a light, and the captured directions that bound it.
"use strict";
(() => {
  // Features of a direction: thin plates about the captured lights, then 1, x, y (srf/planes/light_interpolation.h).
  function featuresOf(x, y, lights) {
    const plates = lights.map(({ towards }) => {
      const r = Math.hypot(x - towards[0], y - towards[1]);
      return r > 0 ? r * r * Math.log(r) : 0;
    });
    return [...plates, 1, x, y];
  }

  // Colour that a byte from 0 to 1 of each plane adds, [r, g, b] a plane, after the constant: ranges are folded in.
  function weightsOf(features, page) {
    const sums = new Array(3 * (page.planes + 1)).fill(0);
    features.forEach((feature, f) => page.functions[f].forEach((value, i) => { sums[i] += feature * value; }));
    for (let k = 0; k < page.planes; ++k) {
      const [least, most] = page.ranges[k];
      for (let c = 0; c < 3; ++c) {
        const weight = sums[3 * (k + 1) + c];
        sums[c] += weight * least;
        sums[3 * (k + 1) + c] = weight * (most - least);
      }
    }
    return sums;
  }

  // Corners of the convex hull of points in the plane, by Andrew's monotone chain.
  function hullOf(points) {
    const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
    const turn = (o, a, b) => (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    const half = (list) => {
      const chain = [];
      for (const p of list) {
        while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], p) <= 0) chain.pop();
        chain.push(p);
      }
      return chain.slice(0, -1);
    };
    const corners = [...half(sorted), ...half(sorted.reverse())];
    return corners.length ? corners : points.slice(0, 1);
  }

  // The point of a convex hull, counter-clockwise, that is nearest to (x, y).
  function nearestInHull(x, y, hull) {
    let nearest = null, least = Infinity, inside = hull.length > 2;
    hull.forEach((a, i) => {
      const b = hull[(i + 1) % hull.length], dx = b[0] - a[0], dy = b[1] - a[1];
      if (dx * (y - a[1]) - dy * (x - a[0]) < 0) inside = false;
      const length = dx * dx + dy * dy;
      const t = length > 0 ? Math.min(1, Math.max(0, ((x - a[0]) * dx + (y - a[1]) * dy) / length)) : 0;
      const p = [a[0] + t * dx, a[1] + t * dy], distance = Math.hypot(p[0] - x, p[1] - y);
      if (distance < least) { least = distance; nearest = p; }
    });
    return inside ? [x, y] : nearest;
  }

  surflect.decode = { featuresOf, weightsOf, hullOf, nearestInHull };
})();
