"""Reads frames of `surflect render` with Python's standard library."""

import struct
import zlib


def read_header(path):
    """Attributes by name, as (type, bytes), and where they end."""
    data, at, header = path.read_bytes(), 8, {}
    while data[at]:
        name, kind, rest = data[at:at + 600].split(b"\0", 2)
        start = at + len(name) + len(kind) + 6
        size, = struct.unpack("<i", rest[:4])
        header[name.decode()] = kind.decode(), data[start:start + size]
        at = start + size
    return header, at


def read_exr(path):
    """Width, height and values row by row of each channel, by its name."""
    data, (header, at) = path.read_bytes(), read_header(path)
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"][1])
    width, height = right - left + 1, bottom - top + 1
    channels, listed = {}, header["channels"][1]
    while listed[0]:
        name, listed = listed.split(b"\0", 1)
        channels[name.decode()] = {1: "e", 2: "f"}[struct.unpack("<i", listed[:4])[0]]
        listed = listed[16:]
    if header["compression"][1] != b"\3":
        raise AssertionError(f"{path} is not compressed by ZIP")
    values = {name: [] for name in channels}
    chunks = (height + 15) // 16
    line = struct.Struct("<" + "".join(f"{width}{kind}" for kind in channels.values()))
    for place in struct.unpack(f"<{chunks}Q", data[at + 1:at + 1 + 8 * chunks]):
        first, size = struct.unpack("<2i", data[place:place + 8])
        wanted, pixels = line.size * min(16, top + height - first), data[place + 8:place + 8 + size]
        if size < wanted:
            pixels = unpredicted(zlib.decompress(pixels))
        for samples in line.iter_unpack(pixels):
            for i, name in enumerate(channels):
                values[name] += samples[i * width:(i + 1) * width]
    return width, height, values


def unpredicted(data):
    """Sums up differences of bytes, then puts the two halves at even and odd places."""
    data = bytearray(data)
    for i in range(1, len(data)):
        data[i] = (data[i - 1] + data[i] - 128) & 255
    result, middle = bytearray(len(data)), (len(data) + 1) // 2
    result[0::2], result[1::2] = data[:middle], data[middle:]
    return bytes(result)
