"""Reads the pictures that nacre renders: one part, scan lines, FLOAT, ZIP or not at all
compressed. For the viewport, which has to have pixels without an image datablock."""

import struct
import zlib

import numpy as np


def _text(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode("ascii"), end + 1


def _header(data):
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError("no OpenEXR file")
    at = 8
    attributes = {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _channels(data):
    names, at = [], 0
    while data[at]:
        name, at = _text(data, at)
        if struct.unpack_from("<i", data, at)[0] != 2:
            raise ValueError("channel %s isn't FLOAT" % name)
        names.append(name)
        at += 16
    return names


def _unpack(block, size):
    if len(block) == size:
        return block
    mixed = np.frombuffer(zlib.decompress(block), dtype=np.uint8).astype(np.int64)
    mixed[1:] -= 128
    mixed = np.cumsum(mixed).astype(np.uint8)
    half = (size + 1) // 2
    whole = np.empty(size, dtype=np.uint8)
    whole[0::2] = mixed[:half]
    whole[1::2] = mixed[half:]
    return whole.tobytes()


def read(path):
    """(height, width, 4) floats, the bottom row first, as Blender has them."""
    with open(path, "rb") as file:
        data = file.read()
    attributes, at = _header(data)
    names = _channels(attributes["channels"])
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    lines = {0: 1, 2: 1, 3: 16}.get(attributes["compression"][0])
    if lines is None:
        raise ValueError("compression %d" % attributes["compression"][0])
    offsets = struct.unpack_from("<%dQ" % -(-height // lines), data, at)
    pixels = np.empty((height, len(names), width), dtype=np.float32)
    for offset in offsets:
        y, size = struct.unpack_from("<ii", data, offset)
        count = min(lines, height - (y - top))
        block = _unpack(data[offset + 8:offset + 8 + size], count * len(names) * width * 4)
        pixels[y - top:y - top + count] = np.frombuffer(block, "<f4").reshape(
            count, len(names), width)
    result = np.ones((height, width, 4), dtype=np.float32)
    for index, name in enumerate("RGBA"):
        source = name if name in names else ("Y" if name != "A" else None)
        if source in names:
            result[:, :, index] = pixels[::-1, names.index(source)]
    return result
