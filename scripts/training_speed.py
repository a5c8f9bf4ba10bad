#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Usage: training_speed.py UNIRIT_TRAIN [--cores N...] [--batch N] [--points N] [--steps N]
       [--iterations N] [--repeats N]

Trains networks by UNIRIT_TRAIN and by python's torch in turn, on the same cores, and prints a
Markdown table of the medians of their speeds, in pairs a second of the clock and a second of a
core's time, which other work on the machine disturbs less: the published rigid module, both
published modules, and the flow module. The python side (torch_training.py) has the same layers,
batch, points, loss, iterations, an optimiser step after each pass, as many decoded points, and the
decoder's global columns once a pair. Its clouds lie ready in memory; unirit_train makes its
pairs meanwhile, on the same cores. Torch has glibc keep its memory, as unirit_train does itself,
and OpenBLAS on one thread or on all cores, whichever is faster.

Needs Debian's python3-torch, which nothing else here does, so it is not in packages.txt.
"""
import argparse
import csv
import os
import statistics
import subprocess
import sys
import tempfile
import time

DECODED_POINTS = 64  # of each pair, by the published non-rigid module
# Memory of a step that goes back to the system is cleared page by page in the next: with settings
# of glibc's own torch is up to three times slower.
KEEP_MEMORY = {"MALLOC_MMAP_MAX_": "0", "MALLOC_TRIM_THRESHOLD_": str(1 << 40),
               "MALLOC_TOP_PAD_": str(64 << 20)}
PHASES = {"rigid": ("nearest", 0.0), "both": ("nearest", 0.5),
          "flow": ("offsets", 0.5)}  # pairing and weight of the global loss


def environment(cores):
    """OpenBLAS 0.3.21 does not know recent processors, and takes its slowest kernels there. Threads
    of OpenMP that wait busily would keep those of OpenBLAS from the cores."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        flags = file.read().split()
    kernels = {"OPENBLAS_CORETYPE": "SkylakeX"} if "avx512bw" in flags else \
        {"OPENBLAS_CORETYPE": "Haswell"} if "avx2" in flags else {}
    return dict(os.environ, OMP_NUM_THREADS=str(cores), OMP_WAIT_POLICY="passive", **kernels)


def start_on(cores, command, **variables):
    os.sched_setaffinity(0, cores)  # inherited by the command
    return subprocess.Popen(command, env=dict(environment(len(cores)), **variables),
                            stdout=subprocess.PIPE, text=True)


def processor_seconds(process):
    """Of all its threads so far."""
    with open(f"/proc/{process.pid}/stat", encoding="utf-8") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def rows_of(path):
    try:
        with open(path, encoding="utf-8") as file:
            return list(csv.DictReader(file))
    except FileNotFoundError:
        return []


def speed_of_unirit(options, phase, cores):
    """Pairs a second, and a second of a core, once iterations and steps have grown: of the second
    and third row. A core's time includes that of two validations, a few percent."""
    with tempfile.TemporaryDirectory() as folder:
        curves = os.path.join(folder, "curves.csv")
        with start_on(cores, [
                options.unirit_train, "--phantoms", "1", "--output", folder, "--threads",
                str(len(cores)), "--pairing", PHASES[phase][0], "--alpha", str(PHASES[phase][1]),
                "--decoded-points", str(DECODED_POINTS), "--batch", str(options.batch),
                "--points", str(options.points), "--iterations", str(options.iterations),
                "--steps", str(3 * options.steps), "--report-every", str(options.steps)]) as train:
            used = []
            while len(used) < 3 and train.poll() is None:
                if len(rows_of(curves)) > len(used):
                    used.append(processor_seconds(train))
                time.sleep(0.01)
            train.communicate()
        if train.returncode != 0 or len(used) < 3:
            sys.exit("unirit_train failed, or was too fast to be watched: take more --steps")
        rows = rows_of(curves)
    pairs = 2 * options.steps * options.batch
    return (statistics.harmonic_mean([float(row["pairs_per_second"]) for row in rows[1:]]),
            pairs / (used[2] - used[0]))


def speed_of_torch(options, phase, cores, blas_threads):
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "torch_training.py")
    pairing, alpha = PHASES[phase]
    with start_on(cores, [
            sys.executable, script, pairing, "--alpha", str(alpha), "--cores", str(len(cores)),
            "--batch", str(options.batch), "--points", str(options.points), "--steps",
            str(options.steps), "--iterations", str(options.iterations)],
                  OPENBLAS_NUM_THREADS=str(blas_threads), **KEEP_MEMORY) as train:
        output = train.stdout.read()
    if train.returncode != 0:
        sys.exit("python's torch failed")
    return tuple(float(number) for number in output.split())


def compare(options):
    every_core = sorted(os.sched_getaffinity(0))
    print(f"{options.batch} pairs a step, {options.points} points, {options.iterations} rigid "
          f"iterations; medians of {options.repeats}\n")
    print("| cores | modules trained | unirit_train: pairs/s (steps/s) | pairs per core-second "
          "| python torch: pairs/s (steps/s) | pairs per core-second | ratio | per core-second |")
    print("|---|---|---|---|---|---|---|---|")
    for count in options.cores:
        cores = every_core[:count]
        for phase in PHASES:
            speeds = [max(speed_of_torch(options, phase, cores, threads)
                          for threads in {1, count}) + speed_of_unirit(options, phase, cores)
                      for _ in range(options.repeats)]
            torch, torch_core, unirit, unirit_core = map(statistics.median, zip(*speeds))
            print(f"| {count} | {phase} | {unirit:.1f} ({unirit / options.batch:.2f}) "
                  f"| {unirit_core:.1f} | {torch:.1f} ({torch / options.batch:.2f}) "
                  f"| {torch_core:.1f} | {unirit / torch:.2f} | {unirit_core / torch_core:.2f} |",
                  flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("unirit_train")
    parser.add_argument("--cores", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--batch", type=int, default=32)
    parser.add_argument("--points", type=int, default=256)
    parser.add_argument("--steps", type=int, default=20, help="measured; as many warm up")
    parser.add_argument("--iterations", type=int, default=4)
    parser.add_argument("--repeats", type=int, default=3)
    compare(parser.parse_args())


if __name__ == "__main__":
    main()
