# SPDX-License-Identifier: BSD-3-Clause
"""Reads the clouds that unirit's programs write."""
import numpy as np


def read_ply(path):
    """Vertices of a binary PLY of float properties that begin with x, y, z: N x 3."""
    with open(path, "rb") as file:
        content = file.read()
    start = content.index(b"end_header\n") + len(b"end_header\n")
    head = content[:start].decode().split("element vertex ")[1].split("element ")[0]
    shape = int(head.split()[0]), head.count("property float")
    return np.frombuffer(content, "<f4", shape[0] * shape[1], start).reshape(shape)[:, :3]
