"""Draws Gaussians of a PLY file as renderers of 3D Gaussian splatting do, plainly and in double precision.

[Kerbl 2023]   3D Gaussian Splatting for Real-Time Radiance Field Rendering, TOG 42(4): front to back, o exp(-x^T V^-1 x / 2),
               at most 0.99 and not below 1/255; colour 1/2 + sum_j f_j Y_j(direction from the viewer); 0.3 pixels^2 added to V.
[Zwicker 2002] EWA Splatting, TVCG 8(3): V = J R Sigma R^T J^T, J the Jacobian of the projection at the Gaussian's centre.
"""

import math

import numpy as np


def read_ply(path):
    """Columns of floats by name, in the file's order."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    lines = header.decode().splitlines()
    if lines[:2] != ["ply", "format binary_little_endian 1.0"]:
        raise ValueError(f"{path}: found {lines[:2]}")
    count, = (int(line.split()[2]) for line in lines if line.startswith("element vertex "))
    names = [line.split()[2] for line in lines if line.startswith("property float ")]
    rows = np.frombuffer(body, "<f4").reshape(count, len(names))
    return {name: rows[:, k].astype(float) for k, name in enumerate(names)}


def harmonics(directions):
    """Real spherical harmonics up to degree 3 by associated Legendre functions with the Condon-Shortley phase."""
    x, y, z = directions.T
    around, s = np.arctan2(y, x), np.sqrt(np.maximum(0, 1 - z * z))
    legendre = {(0, 0): np.ones_like(z), (1, 0): z, (1, 1): -s,
                (2, 0): (3 * z * z - 1) / 2, (2, 1): -3 * z * s, (2, 2): 3 * s * s,
                (3, 0): (5 * z**3 - 3 * z) / 2, (3, 1): -3 / 2 * (5 * z * z - 1) * s, (3, 2): 15 * z * s * s, (3, 3): -15 * s**3}
    values = []
    for l in range(4):
        for m in range(-l, l + 1):
            order = abs(m)
            scale = math.sqrt((2 * l + 1) / (4 * math.pi) * math.factorial(l - order) / math.factorial(l + order))
            turn = 1 if m == 0 else math.sqrt(2) * (np.cos(order * around) if m > 0 else np.sin(order * around))
            values.append(scale * legendre[l, order] * turn)
    return np.array(values)


def columns(gaussians, name, count):
    return np.stack([gaussians[f"{name}_{k}"] for k in range(count)], 1)


def colors(gaussians, directions):
    """Colour of each Gaussian in a direction from the viewer."""
    rest = sum(name.startswith("f_rest") for name in gaussians) // 3
    values = harmonics(directions)[:rest + 1]
    coefficients = np.concatenate([columns(gaussians, "f_dc", 3)[:, :, None],
                                   columns(gaussians, "f_rest", 3 * rest).reshape(-1, 3, rest)], 2)
    return np.maximum(0, 0.5 + np.einsum("icj,ji->ic", coefficients, values))


def rotations(gaussians):
    w, x, y, z = columns(gaussians, "rot", 4).T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def draw(gaussians, turn, shift, focal, center, size):
    """Premultiplied colour and alpha, height x width x 4. Camera: turn @ p + shift; x right, y down, looking along z."""
    width, height = size
    points = columns({f"p_{k}": gaussians[name] for k, name in enumerate("xyz")}, "p", 3)
    placed = points @ turn.T + shift
    away = points + turn.T @ shift
    color = colors(gaussians, away / np.linalg.norm(away, axis=1)[:, None])
    opacity = 1 / (1 + np.exp(-gaussians["opacity"]))
    x, y, z = placed.T
    jacobian = np.zeros((len(z), 2, 3))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = focal / z
    jacobian[:, 0, 2], jacobian[:, 1, 2] = -focal * x / z**2, -focal * y / z**2
    axes = jacobian @ turn @ rotations(gaussians) * np.exp(columns(gaussians, "scale", 3))[:, None, :]
    spread = axes @ axes.transpose(0, 2, 1) + 0.3 * np.eye(2)
    inverse = np.linalg.inv(spread)
    u, v = focal * x / z + center[0], focal * y / z + center[1]

    def pixels(middle, variance, count):
        reach = 3.4 * np.sqrt(variance)  # where alpha falls below 1/255
        first, last = np.ceil(middle - reach - 0.5), np.floor(middle + reach - 0.5) + 1
        return np.clip(first, 0, count).astype(int), np.clip(last, 0, count).astype(int)

    (left, right), (top, bottom) = pixels(u, spread[:, 0, 0], width), pixels(v, spread[:, 1, 1], height)
    columns_at, rows_at = np.arange(width) + 0.5, np.arange(height)[:, None] + 0.5
    picture, through = np.zeros((height, width, 3)), np.ones((height, width))
    for i in np.argsort(z, kind="stable"):
        if z[i] <= 0 or left[i] >= right[i] or top[i] >= bottom[i]:
            continue
        part = slice(top[i], bottom[i]), slice(left[i], right[i])
        if through[part].max() < 1e-4:
            continue
        dx, dy = columns_at[part[1]] - u[i], rows_at[part[0]] - v[i]
        (a, b), (_, c) = inverse[i]
        alpha = np.minimum(0.99, opacity[i] * np.exp(-(a * dx * dx + 2 * b * dx * dy + c * dy * dy) / 2))
        alpha[alpha < 1 / 255] = 0
        picture[part] += (alpha * through[part])[:, :, None] * color[i]
        through[part] *= 1 - alpha
    return np.dstack([picture, 1 - through])
