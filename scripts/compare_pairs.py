#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Usage: compare_pairs.py PAIRS.safetensors CASES...

Compares a pair set with folders of cases that another program made of the same organs, with other
seeds in each folder (CASES/PROTOCOL/ORGAN_SUBJECT, see docs/pairs.md), and prints a Markdown table
per statistic. PAIRS must hold several deformations of each organ: their spread within a subject
tells how far the two means may be apart, and z is how far they are, in standard errors. Exit status
0 where no |z| exceeds 4, else 1.
"""
import collections
import json
import pathlib
import sys

import numpy as np

from point_files import read_ply

STATISTICS = ("before", "target to truth", "truth to target")
LARGEST_Z = 4.0
ROUNDING = 1e-3  # of coordinates in single precision [mm]


class PairSet:
    """The tensors of a pair set by name, and the cases and protocols that its metadata list."""

    def __init__(self, path):
        self.data = np.memmap(path, mode="r")
        self.start = 8 + int.from_bytes(self.data[:8].tobytes(), "little")
        self.header = json.loads(self.data[8 : self.start].tobytes())
        self.cases = json.loads(self.header["__metadata__"]["cases"])
        self.protocols = json.loads(self.header["__metadata__"]["protocols"])

    def tensor(self, name):
        entry = self.header[name]
        first, last = entry["data_offsets"]
        kind = {"F32": "<f4", "F64": "<f8"}[entry["dtype"]]
        return self.data[self.start + first : self.start + last].view(kind).reshape(entry["shape"])


def statistics(source, target, truth):
    """In the clouds' unit: RMS distance to the truth, mean nearest distances either way."""
    squares = target @ (-2.0 * truth.T)
    squares += (target**2).sum(1)[:, None]
    squares += (truth**2).sum(1)
    before = np.sqrt(((source - truth) ** 2).sum(1).mean())
    return before, *(np.sqrt(np.maximum(squares.min(axis), 0.0)).mean() for axis in (1, 0))


def of_pair_set(pairs, protocol):
    """Statistics in mm of every case, by organ_subject."""
    sources, truths = pairs.tensor("source"), pairs.tensor("truth")
    targets, poses = pairs.tensor(protocol + "/target"), pairs.tensor(protocol + "/pose")
    found = collections.defaultdict(list)
    for case, source, truth, target, pose in zip(pairs.cases, sources, truths, targets, poses):
        if case["variation"] == 0:
            moved = truth @ pose[:3, :3].T + pose[:3, 3]
            values = statistics(source.astype(float), target.astype(float), moved)
            found[case["organ"] + "_" + case["subject"]].append(1000.0 * np.array(values))
    return found


def of_folder(folder):
    names = ("source.ply", "target.ply", "truth.ply")
    return np.array(statistics(*(read_ply(folder / name).astype(float) for name in names)))


def compare(found, folders, organs):
    """Rows (organ, subjects, mean of the cases, mean of the pair set, z), a column a statistic."""
    cases = collections.defaultdict(list)
    for path in sorted(path for folder in folders for path in folder.iterdir()):
        if len(found.get(path.name, [])) > 1:
            cases[path.name].append(of_folder(path))
    subjects = collections.defaultdict(list)
    for name in sorted(cases):
        subjects[organs[name]].append(name)
    for organ, names in [*sorted(subjects.items()), ("all", sorted(cases))]:
        theirs = np.array([np.mean(cases[name], axis=0) for name in names])
        ours = np.array([np.mean(found[name], axis=0) for name in names])
        variance = sum(
            np.var(found[name], axis=0, ddof=1) * (1.0 / len(cases[name]) + 1.0 / len(found[name]))
            for name in names
        )
        z = (theirs - ours).sum(0) / np.sqrt(variance + ROUNDING**2)
        yield organ, len(names), theirs.mean(0), ours.mean(0), z


def main(pair_set, *roots):
    pairs = PairSet(pair_set)
    organs = {case["organ"] + "_" + case["subject"]: case["organ"] for case in pairs.cases}
    tables = {name: [] for name in STATISTICS}
    for protocol in pairs.protocols:
        folders = [path for path in (pathlib.Path(root) / protocol for root in roots) if path.is_dir()]
        if not folders:
            continue
        for organ, count, theirs, ours, z in compare(of_pair_set(pairs, protocol), folders, organs):
            for i, name in enumerate(STATISTICS):
                tables[name].append((protocol, organ, count, theirs[i], ours[i], z[i]))
    if not tables["before"]:
        sys.exit("compare_pairs.py: the two have no protocol and subject in common")
    for name, rows in tables.items():
        print(f"\n{name} [mm]\n\n| protocol | organ | subjects | cases | pair set | z |")
        print("|---|---|---|---|---|---|")
        for protocol, organ, count, theirs, ours, z in rows:
            print(f"| {protocol} | {organ} | {count} | {theirs:.2f} | {ours:.2f} | {z:+.1f} |")
    worst = max(abs(row[-1]) for rows in tables.values() for row in rows)
    print(f"\nlargest |z| {worst:.1f} of {sum(map(len, tables.values()))}")
    return 0 if worst <= LARGEST_Z else 1


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
