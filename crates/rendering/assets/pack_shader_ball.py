#!/usr/bin/env python3
"""Packs a binary PLY file of the standard shader ball: coordinates rounded to what can be seen, vertices in the order
of their use (indices that grow slowly pack well), gzip without a date.

Usage: pack_shader_ball.py material_surface.ply[.gz] shader_ball.ply.gz
"""
import gzip
import struct
import sys

# Steps of x, y, z, of the normal and of the texture coordinates.
STEPS = [2.0**-16] * 3 + [2.0**-9] * 3 + [2.0**-13] * 2


def main(source, target):
    opened = gzip.open if source.endswith(".gz") else open
    with opened(source, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode("ascii")
    count = {w[1]: int(w[2]) for w in map(str.split, header.splitlines()) if w[0] == "element"}
    assert header.count("property float") == len(STEPS) and "uchar int" in header, header
    vertices = list(struct.iter_unpack("<8f", data[end : end + 32 * count["vertex"]]))
    faces = list(struct.iter_unpack("<B3i", data[end + 32 * count["vertex"] :]))
    assert len(faces) == count["face"] and all(f[0] == 3 for f in faces)
    order = list(dict.fromkeys(i for face in faces for i in face[1:]))
    place = {old: new for new, old in enumerate(order)}
    rounded = lambda v: [round(x / step) * step + 0.0 for x, step in zip(v, STEPS)]
    header = header.replace(f"element vertex {count['vertex']}", f"element vertex {len(order)}")
    body = b"".join(struct.pack("<8f", *rounded(vertices[i])) for i in order)
    body += b"".join(struct.pack("<B3i", 3, *(place[i] for i in face[1:])) for face in faces)
    with open(target, "wb") as file:
        file.write(gzip.compress(header.encode("ascii") + body, 9, mtime=0))


if __name__ == "__main__":
    main(*sys.argv[1:])
