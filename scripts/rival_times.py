#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Times the rivals' origins beside this package, on the same clouds in the same run:

    rival_times.py CPD BCPD UNIRIT_BENCHMARK CASES

CPD and BCPD are checkouts as for compare_rivals.py, UNIRIT_BENCHMARK the program of that name,
CASES a folder of cases as it reads them. Every EVERY-th case of each protocol is registered by the
refinement, by the rivals of the benchmark and by the programs they come from, BCPD without and with
its acceleration, with the parameters tuned for the protocol, on one thread, each until its own
criterion or limit of iterations ends it. Prints the mean processor time of a registration: of a
program from its start, reading and writing of text included (some milliseconds); of the refinement
with what is computed once for an organ.
"""
import csv
import os
import resource
import subprocess
import sys
import tempfile

import numpy as np

from compare_rivals import build, require, theirs, write_clouds

WEIGHTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../models/unirit.safetensors")
EVERY = 15
METHODS = ["refine", "cpd", "bcpd"]
ORIGINS = {"refine": [], "cpd": [()], "bcpd": [(), ("-A",)]}  # options of each run
UNIT_COORDINATES = {"cpd": 1, "bcpd": 3}  # over which a cloud's variance is taken for its unit
PROTOCOLS = ["permuted", "resampled", "caseb", "partial", "intraop"]


def benchmark_rows(program, cases, folder):
    command = [program, "--cases", cases, "--protocols", ",".join(PROTOCOLS),
               "--methods", "refine@unirit:stages=refine,cpd,bcpd",
               "--weights", WEIGHTS, "--shard", f"1/{EVERY}", "--threads", "1", "--output", folder]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(os.path.join(folder, f"cases-1of{EVERY}.csv"), encoding="utf-8") as file:
        return list(csv.DictReader(file))


def parameters_of(row):
    pairs = (word.split("=") for word in row["parameters"].split(":"))
    return {name: float(value) for name, value in pairs}


def children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def time_of_origin(row, cases, folder, options=()):
    """Processor time of the program that a benchmark's row comes from, on the row's case [ms]."""
    case = os.path.join(cases, row["protocol"], f"{row['organ']}_{row['subject']}")
    parameters = parameters_of(row)
    write_clouds(case, folder, int(row["points"].split("+")[0]), parameters["centroids"] == 1,
                 UNIT_COORDINATES[row["method"]])
    begin = children_seconds()
    theirs(row["method"], parameters, 0, folder, options)
    return 1e3 * (children_seconds() - begin)


def main(cpd, bcpd, program, cases):
    require(f"{cpd}/include/cpd", f"{bcpd}/register", program, cases)
    with tempfile.TemporaryDirectory() as folder:
        build(os.path.abspath(cpd), os.path.abspath(bcpd), folder)
        rows = benchmark_rows(program, cases, folder)
        print("| protocol | cases | refine | cpd | its origin | bcpd | its origin | accelerated |")
        print("|---" * 8 + "|")
        for protocol in PROTOCOLS:
            means = []
            for method in METHODS:
                chosen = [row for row in rows
                          if row["protocol"] == protocol and row["method"] == method]
                means.append(np.mean([float(row["cpu_ms"]) for row in chosen]))
                for options in ORIGINS[method]:
                    means.append(np.mean([time_of_origin(row, cases, folder, options)
                                          for row in chosen]))
            print(f"| {protocol} | {len(chosen)} | " +
                  " | ".join(f"{mean:.0f}" for mean in means) + " |", flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
