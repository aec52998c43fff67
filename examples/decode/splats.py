"""Splats of surfels: Gaussians on the screen, grouped into layers by depth."""

import numpy as np

CUTOFF = 3.5 ** 2  # of squared distances, in standard deviations
OPAQUE, ANCHOR = 0.7, 0.5  # areas of a pixel: from which it is opaque; from which a layer extends no further back
LOW_PASS = 0.44  # least standard deviation, pixels


def footprints(camera, points, frames, radius, coverage):
    """Of splats that face the viewer: place and order, inverse covariance and covariance, peak, slope and tolerance."""
    p = (points - camera.position) @ camera.axes.T
    u, v = (frames[:, :, k] @ camera.axes.T for k in (0, 1))
    normal, depth, s = np.cross(u, v), p[:, 2], 0.6 * radius
    origin = np.stack([p[:, 0] / depth, p[:, 1] / depth, -1 / depth], 1)
    w = np.stack([u[:, 2], v[:, 2]], 1) / depth[:, None]
    tangents = np.stack([u, v], 2)
    axes = np.stack([tangents[:, 0] / depth[:, None] - origin[:, :1] * w,
                     tangents[:, 1] / depth[:, None] - origin[:, 1:2] * w, w / depth[:, None]], 1)
    share = s ** 2 / (1 - s ** 2 * (w ** 2).sum(1))
    shift = -share[:, None] * (axes @ w[:, :, None])[:, :, 0]
    covariance = share[:, None, None] * axes @ axes.swapaxes(1, 2) + shift[:, :, None] * shift[:, None]
    scale = np.array([camera.focal, camera.focal, 1])
    mean = (origin + shift) * scale + (camera.width / 2, camera.height / 2, 0)
    covariance = covariance * scale[:, None] * scale
    V, C = covariance[:, :2, :2], covariance[:, :2, 2:]
    values, vectors = np.linalg.eigh(V)
    D = vectors * np.maximum(0, LOW_PASS ** 2 - np.maximum(values, 0))[:, None] @ vectors.swapaxes(1, 2)
    inverse = np.linalg.inv(V + D)
    peak = coverage * np.sqrt(np.maximum(0, np.linalg.det(V)) * np.linalg.det(inverse))
    thick = LOW_PASS ** 2 / 4 / (1 + LOW_PASS ** 2 / values[:, 1])
    bent = D @ np.linalg.solve(V + thick[:, None, None] * np.eye(2), C)
    area = np.linalg.norm(normal, axis=1)
    cosine = np.maximum(abs((normal * p).sum(1)) / depth / area, 1e-300)
    tolerance = 2 * np.sqrt((bent.swapaxes(1, 2) @ inverse @ bent)[:, 0, 0]) + \
        s * np.sqrt(area) * np.minimum(0.15 / cosine, 1) / depth ** 2
    front = np.flatnonzero((normal * p).sum(1) < 0)
    slope = (inverse @ C)[:, :, 0]
    return [part[front] for part in (mean, inverse, V + D, peak, slope, tolerance)] + [front]


def splatted(camera, points, frames, surfels, colors, told):
    """The picture, and which pixels are full of splats whose colours are told."""
    mean, inverse, covariance, peak, slope, tolerance, splats = footprints(
        camera, points, frames, surfels["radius"], surfels["coverage"])
    half = np.sqrt(CUTOFF * covariance[:, [0, 1], [0, 1]])
    size = np.array([camera.width, camera.height])
    low = np.clip(np.ceil(mean[:, :2] - half - 0.5), 0, size).astype(int)
    span = np.maximum(np.clip(np.floor(mean[:, :2] + half + 0.5), 0, size).astype(int) - low, 0)
    count = span.prod(1)
    of = np.repeat(np.arange(len(count)), count)
    nth = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    x, y = low[of, 0] + nth % span[of, 0], low[of, 1] + nth // span[of, 0]
    d = np.stack([x, y], 1) + 0.5 - mean[of, :2]
    q = (d[:, None] @ inverse[of] @ d[:, :, None])[:, 0, 0]
    keep = q <= CUTOFF
    of, q, d, pixel = of[keep], q[keep], d[keep], (y * camera.width + x)[keep]
    gaussian, area = peak[of] * np.exp(-q), peak[of] * 6 / CUTOFF * (1 - q / CUTOFF) ** 2
    order = mean[of, 2] + (slope[of] * d).sum(1)
    sort = np.lexsort((of, order, pixel))
    picture, known = np.zeros((camera.height * camera.width, 3)), np.zeros(camera.height * camera.width, bool)
    for fragments in np.split(sort, np.flatnonzero(np.diff(pixel[sort])) + 1):
        at, total, alpha, begin = pixel[fragments[0]], 0, 0, 0
        known[at] = True
        while begin < len(fragments) and alpha < 1:
            back, of_layer, end = -np.inf, 0, begin
            for f in fragments[begin:]:
                if end > begin and order[f] - tolerance[of[f]] > back:
                    break
                if of_layer < ANCHOR:
                    back = max(back, order[f] + tolerance[of[f]])
                of_layer, end = of_layer + area[f], end + 1
            layer = fragments[begin:end]
            total += of_layer
            before, alpha = alpha, np.clip((total - (1 - OPAQUE)) / (2 * OPAQUE - 1), 0, 1)
            shown = splats[of[layer]]
            if alpha > before:
                picture[at] += (alpha - before) * (gaussian[layer] @ colors[shown]) / gaussian[layer].sum()
                known[at] &= told[shown].all()
            begin = end
        known[at] &= alpha == 1
    return picture.reshape(camera.height, camera.width, 3), known.reshape(camera.height, camera.width)
