"""Images as files that the renderer reads: PNG (its numbers as they are) and EXR."""

import os
import struct
import zlib

import bpy
import numpy as np


def _png(path, pixels):
    height, width = pixels.shape[:2]
    rows = np.clip(pixels[::-1, :, :3] * 255 + 0.5, 0, 255).astype(np.uint8)
    raw = b"".join(b"\0" + row.tobytes() for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))

    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        file.write(chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)))
        file.write(chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))


def _exr(path, pixels):
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("nacre", width, height, alpha=True, float_buffer=True)
    try:
        image.colorspace_settings.name = "Non-Color"  # the numbers as they are
        image.pixels.foreach_set(np.dstack(
            [pixels[:, :, :3], np.ones((height, width), dtype=np.float32)]).ravel())
        image.filepath_raw = path
        image.file_format = "OPEN_EXR"
        image.save()
    finally:
        bpy.data.images.remove(image)


def file_of(image, folder):
    """The path of a file with the image's pixels: its own if the renderer reads that, else a
    file in `folder`: EXR if they are floats, or PNG. Raises ValueError if it has none."""
    own = bpy.path.abspath(image.filepath, library=image.library) if image.filepath else ""
    plain = image.source == "FILE" and not image.packed_file and not image.is_dirty
    if plain and own.lower().endswith((".png", ".exr")) and os.path.isfile(own):
        return own
    width, height = image.size
    if width == 0 or height == 0:
        raise ValueError("image '%s' has no pixels (is its file missing?)" % image.name)
    pixels = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, image.channels)
    if image.channels < 3:
        pixels = np.repeat(pixels[:, :, :1], 3, axis=2)
    stem = os.path.join(folder, bpy.path.clean_name(image.name_full))
    if image.is_float:
        _exr(stem + ".exr", pixels)
        return stem + ".exr"
    _png(stem + ".png", pixels)
    return stem + ".png"
