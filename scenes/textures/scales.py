#!/usr/bin/env python3
"""Makes scales.png: tangent-space normals of overlapping scales that repeat in both directions (green up)."""
import struct, zlib
from math import hypot, sqrt

SIDE = 128


def height(u, v):
    """Rounded scales in two rows a unit, each row shifted by half and lying over the one below it."""
    best = 0.0
    for row in range(-1, 5):
        for column in range(-1, 3):
            cx, cy = column + 0.5 * (row % 2), row * 0.5
            d = hypot(u - cx, (v - cy) * 1.1) / 0.62
            if d < 1:
                best = max(best, 0.35 * sqrt(1 - d * d) + 0.35 * (cy - v) + 0.3)
    return best


def pixel(x, y):
    e = 0.5 / SIDE
    u, v = (x + 0.5) / SIDE, 1 - (y + 0.5) / SIDE
    n = ((height(u - e, v) - height(u + e, v)) / (2 * e) * 0.5, (height(u, v - e) - height(u, v + e)) / (2 * e) * 0.5, 1)
    n = (max(-2, min(2, n[0])), max(-2, min(2, n[1])), 1)
    length = sqrt(sum(c * c for c in n))
    return bytes(round((c / length * 0.5 + 0.5) * 255) for c in n)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


rows = b"".join(b"\0" + b"".join(pixel(x, y) for x in range(SIDE)) for y in range(SIDE))
with open("scales.png", "wb") as f:
    f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", SIDE, SIDE, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))
