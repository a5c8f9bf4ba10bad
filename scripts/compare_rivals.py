#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compares the benchmark's rivals with the programs they come from:

    compare_rivals.py CPD BCPD UNIRIT_RIVAL CASE...

CPD is a checkout of github.com/gadomski/cpd, BCPD one of github.com/ohirose/bcpd, UNIRIT_RIVAL the
program of that name, each CASE a folder with source.ply and target.ply as unirit_benchmark reads
them. Builds both origins in a temporary folder (cmake, g++, gcc, Eigen, OpenBLAS), runs either side
for the same number of iterations with the same parameters on the same clouds, and prints the
largest distance between moved points, in units of the source's RMS radius. Fails above TOLERANCE,
which is above the six decimals that BCPD writes. Our displacement fields are given KERNEL_TOLERANCE:
what they leave out by default can grow in iterations that have not settled.
"""
import os
import subprocess
import sys
import tempfile

import numpy as np

from point_files import read_ply

TOLERANCE = 1e-5
KERNEL_TOLERANCE = 1e-11
POINTS = 400  # of either cloud: the origin of CPD factors a matrix of as many rows at every step
ITERATIONS = [5, 30, 80]
CPD = [{"beta": 2, "lambda": 2, "w": 0.1}, {"beta": 0.7, "lambda": 20, "w": 0.01},
       {"beta": 1.5, "lambda": 5, "w": 0.5}]
BCPD = [{"beta": 2, "lambda": 2, "omega": 0, "gamma": 1, "scale": 1},
        {"beta": 1, "lambda": 10, "omega": 0.1, "gamma": 0.3, "scale": 0},
        {"beta": 0.7, "lambda": 5, "omega": 0.3, "gamma": 1, "scale": 1}]


def require(*paths):
    """Before minutes of building."""
    for path in paths:
        if not os.path.exists(path):
            sys.exit(f"{path}: no such file or folder")


def run(*command):
    quiet = dict(os.environ, OMP_NUM_THREADS="1")
    subprocess.run([str(word) for word in command], check=True, env=quiet,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def build(cpd, bcpd, folder):
    run("cmake", "-S", cpd, "-B", f"{folder}/cpd", "-DCMAKE_BUILD_TYPE=Release",
        "-DBUILD_SHARED_LIBS=OFF", "-DWITH_TESTS=OFF", "-DWITH_JSONCPP=OFF")
    run("make", "-C", f"{folder}/cpd", "Library-C++")
    source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "cpd_program.cpp")
    run("g++", "-O2", "-std=c++17", "-w", f"-I{cpd}/include", "-I/usr/include/eigen3", source,
        f"{folder}/cpd/libcpd.a", "-o", f"{folder}/cpd_program")
    run("sh", "-c", f"cd '{bcpd}' && gcc -O3 -w -fopenmp -DUSE_OPENMP register/*.c base/*.c "
                    f"-lopenblas -lm -o '{folder}/bcpd'")


def write_clouds(case, folder, points, together=False, coordinates=1):
    """As text, in units of the source's RMS radius over the root of `coordinates`; `together`: with
    their centroids at one place."""
    source, target = (read_ply(f"{case}/{name}.ply")[:points].astype(float)
                      for name in ("source", "target"))
    centre = source.mean(0)
    unit = np.sqrt(((source - centre) ** 2).sum(1).mean() / coordinates)
    np.savetxt(f"{folder}/source", (source - centre) / unit, fmt="%.9f")
    other = target.mean(0) if together else centre
    np.savetxt(f"{folder}/target", (target - other) / unit, fmt="%.9f")


def options(settings):
    return [word for key, value in settings.items() for word in (f"--{key}", value)]


def ours(program, method, settings, folder):
    run(program, method, f"{folder}/source", f"{folder}/target", f"{folder}/ours",
        *options(settings))
    return np.loadtxt(f"{folder}/ours")


def theirs(method, s, iterations, folder, options=()):
    """The source as the origin moves it; with 0 iterations it ends where it would by itself."""
    source, target, output = (f"{folder}/{name}" for name in ("source", "target", "theirs"))
    if method == "bcpd":
        run(f"{folder}/bcpd", "-y", source, "-x", target, "-u", "n", "-q", "-o", f"{folder}/b_",
            "-b", s["beta"], "-l", s["lambda"], "-w", s["omega"], "-g", s["gamma"],
            "-T", "srn" if s["scale"] else "rn",
            *(("-n", iterations, "-N", iterations) if iterations > 0 else ()), *options)
        return np.loadtxt(f"{folder}/b_y.txt")
    if method == "cpd-rigid":
        run(f"{folder}/cpd_program", "rigid", source, target, output, s["w"], iterations)
    else:
        run(f"{folder}/cpd_program", "nonrigid", source, target, output, s["w"], iterations,
            s["beta"], s["lambda"])
    return np.loadtxt(output)


def compare(program, cases, folder):
    print("| method | parameters | " +
          " | ".join(f"{iterations} iterations" for iterations in ITERATIONS) + " |")
    print("|---" * (2 + len(ITERATIONS)) + "|")
    worst = 0.0
    runs = ([("cpd-rigid", {"w": s["w"]}) for s in CPD] + [("cpd", s) for s in CPD] +
            [("bcpd", s) for s in BCPD])
    for method, settings in runs:
        largest = dict.fromkeys(ITERATIONS, 0.0)
        for case in cases:
            write_clouds(case, folder, POINTS)
            for iterations in ITERATIONS:
                fixed = {"iterations": iterations, "kernel_tolerance": KERNEL_TOLERANCE}
                fixed["settling" if method == "bcpd" else "tolerance"] = \
                    iterations if method == "bcpd" else 0
                difference = (ours(program, method, dict(settings, **fixed), folder) -
                              theirs(method, settings, iterations, folder))
                distance = np.linalg.norm(difference, axis=1).max()
                largest[iterations] = max(largest[iterations], distance)
        words = " ".join(f"{key}={value}" for key, value in settings.items())
        print(f"| {method} | {words} | " +
              " | ".join(f"{value:.1e}" for value in largest.values()) + " |", flush=True)
        worst = max(worst, *largest.values())
    return worst


def main(cpd, bcpd, program, *cases):
    require(f"{cpd}/include/cpd", f"{bcpd}/register", program,
            *(f"{case}/{cloud}.ply" for case in cases for cloud in ("source", "target")))
    with tempfile.TemporaryDirectory() as folder:
        build(os.path.abspath(cpd), os.path.abspath(bcpd), folder)
        worst = compare(program, cases, folder)
    print(f"\nlargest difference {worst:.1e}, tolerance {TOLERANCE:.0e}")
    return 0 if worst <= TOLERANCE else 1


if __name__ == "__main__":
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
