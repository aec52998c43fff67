"""Reads pictures of `surflect render`, and writes pictures of a capture, with Python's standard library."""

import struct
import zlib


def read_png(path):
    """Pixels of a picture of 8 or 16 bits: (r, g, b, a) of RGBA, (r, g, b) of RGB, (gray, a) of gray and alpha, (gray,) of gray."""
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", chunk[:10])
        elif kind == b"IDAT":
            packed += chunk
        at += 12 + length
    channels, size = {0: 1, 2: 3, 4: 2, 6: 4}[color], depth // 8
    rows, stride = zlib.decompress(packed), channels * size * width
    above, pixels = bytearray(stride), []
    for y in range(height):
        start = y * (stride + 1)
        row, kind = bytearray(rows[start + 1:start + 1 + stride]), rows[start]
        for i in range(stride):
            left = i - channels * size
            a, b, c = row[left] if left >= 0 else 0, above[i], above[left] if left >= 0 else 0
            paeth = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            row[i] = (row[i] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        samples = struct.unpack(f">{channels * width}{'BH'[size - 1]}", row)
        pixels += zip(*(samples[c::channels] for c in range(channels)))
        above = row
    return pixels


def shares(path):
    """Share of covered pixels, of opaque ones among these, and of lit ones among these."""
    pixels = read_png(path)
    covered = [pixel for pixel in pixels if pixel[3] > 0]
    opaque = [pixel for pixel in covered if pixel[3] == 255]
    lit = [pixel for pixel in opaque if max(pixel[:3]) > 16]
    return len(covered) / len(pixels), len(opaque) / len(covered), len(lit) / len(opaque)


def write_png(path, rows):
    """8-bit picture; its pixels are gray, or (r, g, b, a)."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    is_gray = isinstance(rows[0][0], int)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0 if is_gray else 6, 0, 0, 0)
    pixels = b"".join(b"\0" + bytes(row if is_gray else sum(row, ())) for row in rows)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) +
                     chunk(b"IEND", b""))
