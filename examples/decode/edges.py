"""Corrections of light field maps on the edges of triangles, and texels of maps."""

import numpy as np


def look_up(table, users, blend):
    """Weighted sum of texels of each user's map: blend has (column, row, weight). 0 where there is no map."""
    of_user, values = table
    if not len(values):
        return np.zeros((len(users), values.shape[-1]))
    maps = of_user[users]
    return sum((weight * (maps >= 0))[:, None] * values[maps, row, column] for column, row, weight in blend)


def on_edges(table, n, scalar, of_corners):
    """Values [triangle, corner, side, step, channel] of the n samples on each edge.

    Of surface maps (of_corners) they are those of the corner; scalar maps are stored for each corner apart.
    """
    users = np.arange(len(table[0]))
    maps = users.reshape(-1, 3) if scalar else np.repeat(users[:, None], 3, 1)
    found = np.zeros((*maps.shape, 2, n, 1 if of_corners else table[1].shape[-1]))
    for corner in range(3):
        for side in range(2):
            steps = np.zeros((3, n), int)
            steps[corner], steps[(corner + 1 + side) % 3] = np.arange(n)[::-1], np.arange(n)
            if scalar:
                steps = np.roll(steps, -corner, 0)
            for step in range(n):
                values = look_up(table, maps[:, corner], [(steps[1, step], steps[2, step], np.ones(len(maps)))])
                found[:, corner, side, step] = values[:, corner:corner + 1] if of_corners and not scalar else values
    return found


def corrections(corners, values, codes, of_mean):
    """Differences to the values that count on edges: the means of those of all triangles, in whole codes."""
    own = np.rint(values * codes)
    ends = np.stack([np.stack([corners, np.roll(corners, -1 - side, 1)], 2) for side in range(2)], 2)  # vertices of edges
    ends = np.broadcast_to(ends[:, :, :, None], (*own.shape[:4], 2)).copy()
    ends[:, :, :, 0, 1] = ends[:, :, :, 0, 0]  # the first step is at a vertex alone
    steps = np.indices(own.shape[:4])[3]
    if of_mean:  # the last one, too: that of a surface map is where its hat function is 0
        ends[:, :, :, -1, 0] = ends[:, :, :, -1, 1]
        steps[:, :, :, -1] = 0
    places = np.concatenate([ends.reshape(-1, 2), steps.reshape(-1, 1)], 1)
    _, place, count = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    own = own.reshape(len(place), -1)
    total, low, high = (np.full((len(count), own.shape[1]), start) for start in (0., 255., -255.))
    np.add.at(total, place, own)
    np.minimum.at(low, place, own)
    np.maximum.at(high, place, own)
    mean = total / count[:, None]
    mean = np.sign(mean) * np.floor(np.abs(mean) + 0.5)
    common = np.maximum(np.minimum(mean, low + 127), high - 127)
    return (np.clip(common[place] - own, -127, 127) / codes).reshape(values.shape)


def on_row(rows, triangles, corner, side, distance):
    """Corrections at distances 0..1 from a corner along one of its sides."""
    last = rows.shape[3] - 1
    place = np.clip(distance, 0, 1) * last
    low = np.minimum(place.astype(int), last - 1)
    share = (place - low)[:, None]
    return (1 - share) * rows[triangles, corner, side, low] + share * rows[triangles, corner, side, low + 1]


def fade(b, samples):
    """Share of a correction at a barycentric coordinate, which is 0 on the edge."""
    return np.maximum(1 - b * (samples - 1) / 3, 0)


def from_sides(rows, triangles, b, corner):
    """Corrections of a corner's surface map, between its two edges at the same distance from it."""
    following, before = b[:, (corner + 1) % 3], b[:, (corner + 2) % 3]
    rest, n = following + before, rows.shape[3]
    first, second = (np.where(rest > 0, part / np.where(rest > 0, rest, 1), 0.5) for part in (following, before))
    sides = [on_row(rows, triangles, corner, side, 1 - b[:, corner])[:, 0] for side in range(2)]
    return first * fade(before, n) * sides[0] + second * fade(following, n) * sides[1]


def from_edges(rows, triangles, b):
    """Corrections of a mean, between all edges; b has no corner exactly."""
    total, weights = 0, 0
    for corner in range(3):
        here, there, opposite = (b[:, (corner + i) % 3] for i in range(3))
        weight = here * there + 1e-300
        share = there / np.maximum(here + there, 1e-300)
        total = total + (weight * fade(opposite, rows.shape[3]))[:, None] * on_row(rows, triangles, corner, 0, share)
        weights = weights + weight
    return total / weights[:, None]
