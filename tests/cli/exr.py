"""Reads frames of `surflect render` in half floats with Python's standard library."""

import struct
import zlib


def read_exr(path):
    """Width, height and values row by row of each channel, by its name."""
    data, at, header = path.read_bytes(), 8, {}
    while data[at]:
        name, _, rest = data[at:at + 600].split(b"\0", 2)
        kind_end = data.index(b"\0", data.index(b"\0", at) + 1) + 1
        size, = struct.unpack("<i", rest[:4])
        header[name.decode()] = data[kind_end + 4:kind_end + 4 + size]
        at = kind_end + 4 + size
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels, listed = [], header["channels"]
    while listed[0]:
        name, listed = listed.split(b"\0", 1)
        if struct.unpack("<i", listed[:4]) != (1,):
            raise AssertionError(f"{path}: channel {name.decode()} is not in half floats")
        channels.append(name.decode())
        listed = listed[16:]
    if header["compression"] != b"\3":
        raise AssertionError(f"{path} is not compressed by ZIP")
    values = {name: [] for name in channels}
    chunks = (height + 15) // 16
    for place in struct.unpack(f"<{chunks}Q", data[at + 1:at + 1 + 8 * chunks]):
        first, size = struct.unpack("<2i", data[place:place + 8])
        rows = min(16, top + height - first)
        wanted, pixels = 2 * width * rows * len(channels), data[place + 8:place + 8 + size]
        if size < wanted:
            pixels = unpredicted(zlib.decompress(pixels))
        halves = struct.unpack(f"<{wanted // 2}e", pixels)
        for line in range(rows * len(channels)):
            values[channels[line % len(channels)]] += halves[line * width:(line + 1) * width]
    return width, height, values


def unpredicted(data):
    """Sums up differences of bytes, then puts the two halves at even and odd places."""
    data = bytearray(data)
    for i in range(1, len(data)):
        data[i] = (data[i - 1] + data[i] - 128) & 255
    result, middle = bytearray(len(data)), (len(data) + 1) // 2
    result[0::2], result[1::2] = data[:middle], data[middle:]
    return bytes(result)
