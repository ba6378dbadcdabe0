#!/usr/bin/env python3
"""Draws leaf.png: 0 is the blade, 255 a vein; 96 x 96 pixels of 0.25 mm. No input."""

import math
import random
import struct
import zlib

SIZE = 96


def distance(point, start, end):
    (x, y), (ax, ay), (bx, by) = point, start, end
    dx, dy = bx - ax, by - ay
    t = max(0, min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)))
    return math.hypot(x - ax - t * dx, y - ay - t * dy)


def veins():
    """Segments with half-widths, in pixels: a midrib, and pairs that leave it upwards."""
    middle = SIZE / 2
    segments = [((middle, -5), (middle, SIZE + 5), 2.6)]
    for n in range(9):
        y = SIZE + 14 - 13 * n
        for side in (-1, 1):
            before = (middle, y + 6 * (side > 0))
            for step in range(1, 5):
                after = (middle + side * 13 * step, before[1] - 9 - 1.5 * step)
                segments.append((before, after, 1.7 - 0.25 * step))
                before = after
    return segments


def pixel(x, y, segments, cells):
    shade = 0.0
    for start, end, half_width in segments:
        shade = max(shade, min(1, max(0, half_width + 0.5 - distance((x, y), start, end))))
    near = sorted(math.hypot(x - a, y - b) for a, b in cells)[:2]
    return max(shade, 0.45 * min(1, max(0, 1.2 - (near[1] - near[0]))))


def main():
    draw = random.Random(5)
    cells = [(draw.uniform(-4, SIZE + 4), draw.uniform(-4, SIZE + 4)) for _ in range(150)]
    segments = veins()
    rows = b"".join(
        b"\0" + bytes(round(255 * pixel(x, y, segments, cells)) for x in range(SIZE))
        for y in range(SIZE)
    )

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open("leaf.png", "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        file.write(chunk(b"IHDR", struct.pack(">IIBBBBB", SIZE, SIZE, 8, 0, 0, 0, 0)))
        file.write(chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    main()
