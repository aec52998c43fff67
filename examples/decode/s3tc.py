"""Maps in blocks of S3TC, laid out in tiles as docs/format.md says."""

import numpy as np


def mixtures(first, second, count, four):
    """What the codes of a block stand for: two end points, and mixtures of them, rounded."""
    a, b = first[..., None].astype(float), second[..., None].astype(float)
    steps = np.arange(1, count)
    full = np.concatenate([a, b, ((count - steps) * a + steps * b) / count], -1)
    if count == 3:  # DXT1 without the fourth colour: black
        less = np.concatenate([a, b, (a + b) / 2, 0 * a], -1)
    else:  # DXT5 with six alphas, 0 and 255
        fifths = np.arange(1, 5)
        less = np.concatenate([a, b, ((5 - fifths) * a + fifths * b) / 5, 0 * a, 0 * a + 255], -1)
    return np.floor(np.where(four[..., None], full, less) + 0.5)


def color_blocks(blocks, always_four):
    """Blocks of 8 bytes: [block, texel, red, green, blue]."""
    ends = blocks[:, :4].copy().view("<u2").astype(int)
    fields = np.stack([ends >> 11 & 31, ends >> 5 & 63, ends & 31], 1)  # block, channel, end
    fields = np.stack([fields[:, 0] << 3 | fields[:, 0] >> 2, fields[:, 1] << 2 | fields[:, 1] >> 4,
                       fields[:, 2] << 3 | fields[:, 2] >> 2], 1)
    four = np.repeat((ends[:, 0] > ends[:, 1])[:, None] | always_four, 3, 1)
    colors = mixtures(fields[..., 0], fields[..., 1], 3, four)  # block, channel, code
    codes = blocks[:, 4:].copy().view("<u4") >> 2 * np.arange(16) & 3  # block, texel
    return np.take_along_axis(colors.transpose(0, 2, 1), codes[..., None].astype(int), 1)


def alpha_blocks(blocks):
    """Blocks of 8 bytes: [block, texel]."""
    bits = np.zeros((len(blocks), 8), np.uint8)
    bits[:, :6] = blocks[:, 2:]
    codes = bits.view("<u8") >> 3 * np.arange(16, dtype=np.uint64) & np.uint64(7)
    alphas = mixtures(blocks[:, 0], blocks[:, 1], 7, blocks[:, 0] > blocks[:, 1])
    return np.take_along_axis(alphas, codes.astype(int), 1)


def read_pictures(file, coding, count, width, height):
    """Bytes of pictures [picture, row, column, channel] in coding 1 (DXT1) or 2 (DXT5)."""
    blocks = file.take("u1", count * width * height // 16, 8 * coding)
    texels = color_blocks(blocks[:, -8:], coding == 2)
    if coding == 2:
        texels = np.concatenate([texels, alpha_blocks(blocks[:, :8])[..., None]], -1)
    texels = texels.reshape(-1, height // 4, width // 4, 4, 4, 3 + (coding == 2)).swapaxes(2, 3)
    return texels.reshape(count, height, width, 3 + (coding == 2))


def read_tiles(file, coding, maps, size, channels, is_patch):
    """Bytes of maps [map, row, column, channel] of a table in coding 1 or 2."""
    per_tile = 1 if not is_patch else 6 if channels == 1 else 2
    texels = read_pictures(file, coding, -(-maps // per_tile), *(-(-side // 4) * 4 for side in (size + is_patch, size)))
    values = np.zeros((maps, size, size, channels), np.uint8)
    rows, columns = np.nonzero(np.add.outer(np.arange(size), np.arange(size)) < size + (0 if is_patch else size))
    for number in range(maps):
        shared = number // 3 if channels == 1 else number
        tile, first = (shared // 2, number % 3 if channels == 1 else 0) if is_patch else (number, 0)
        y, x = (size - 1 - rows, size - columns) if is_patch and shared % 2 else (rows, columns)
        values[number, rows, columns] = texels[tile, y, x, first:first + channels]
    return values
