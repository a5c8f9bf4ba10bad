#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Finds the rivals' parameters: tune_rivals.py BENCHMARK CASES OUTPUT [PROTOCOL...]

BENCHMARK is the program unirit_benchmark, CASES a folder of training cases. For every protocol and
method, groups of parameters are searched one after the other, each over its whole grid with the
best of the groups before; the best has the smallest mean RMSE. Every 6th case of the protocol is
used. OUTPUT keeps all rows, so an interrupted search goes on; best.json there holds the answer.
"""
import collections
import csv
import itertools
import json
import os
import subprocess
import sys

PROTOCOLS = ["permuted", "resampled", "caseb", "partial", "intraop"]
ICP = {"max_distance": [0.05, 0.1, 0.2, 0.4, 1], "centroids": [0, 1]}
FIELD = {"beta": [0.7, 1, 1.5, 2.5], "lambda": [1, 5, 20, 100, 500, 2000]}
SEARCHES = {  # method: where the search starts, groups
    "icp": ({}, [ICP]),
    "gicp": ({}, [ICP]),
    "cpd-rigid": ({}, [{"w": [0.1, 0.4, 0.7], "centroids": [0, 1]}]),
    "cpd": ({"beta": 2, "lambda": 2, "w": 0.1},
            [{"centroids": [0, 1]}, FIELD, {"w": [0.01, 0.1, 0.4, 0.7], "centroids": [0, 1]}]),
    "bcpd": ({"beta": 2, "lambda": 2, "omega": 0.1, "centroids": 1},
             [{"scale": [0, 1], "gamma": [0.1, 0.3, 1]}, {"centroids": [0, 1]}, FIELD,
              {"omega": [0, 0.1, 0.3], "centroids": [0, 1]}]),
}
EVERY = 6


def describe(method, parameters):
    return ":".join([method] + [f"{key}={value}" for key, value in parameters.items()])


def label(description):
    return description.replace(":", ";")


def mean_errors(benchmark, cases, output, protocol, descriptions):
    """Mean RMSE of each description over the cases [mm], in their order."""
    subprocess.run(
        [benchmark, "--cases", cases, "--label", "training organs", "--protocols", protocol,
         "--shard", f"1/{EVERY}", "--output", output, "--threads", "2",
         "--methods", ",".join(f"{label(text)}@{text}" for text in descriptions)],
        check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    errors = collections.defaultdict(list)
    with open(os.path.join(output, f"cases-1of{EVERY}.csv"), encoding="utf-8") as file:
        for row in csv.DictReader(file):
            errors[row["method"]].append(float(row["rmse_mm"]))
    return [sum(errors[label(text)]) / len(errors[label(text)]) for text in descriptions]


def search(benchmark, cases, output, protocol, method):
    start, groups = SEARCHES[method]
    best, error = start, float("inf")
    for group in groups:
        grid = [dict(best, **dict(zip(group, values)))
                for values in itertools.product(*group.values())]
        means = mean_errors(benchmark, cases, output, protocol,
                            [describe(method, parameters) for parameters in grid])
        error = min(means)
        best = grid[means.index(error)]
    return {"parameters": best, "rmse_mm": round(error, 2)}


def main(benchmark, cases, output, *protocols):
    found = {}
    for protocol in protocols or PROTOCOLS:
        for method in SEARCHES:
            best = search(benchmark, cases, os.path.join(output, protocol), protocol, method)
            found.setdefault(protocol, {})[method] = best
            print(protocol, describe(method, best["parameters"]), best["rmse_mm"], flush=True)
    with open(os.path.join(output, "best.json"), "w", encoding="utf-8") as file:
        json.dump(found, file, indent=2)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
