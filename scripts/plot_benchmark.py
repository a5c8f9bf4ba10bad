#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws what unirit_benchmark wrote: plot_benchmark.py FOLDER [OUTPUT]

FOLDER is the benchmark's --output. OUTPUT (default: FOLDER/plots) gets PNG and SVG files for each
protocol: error per organ, error against the displacement before, accuracy against time; the error
against the share in view, where it ran on several (partial:50,partial:40,...); and, where it ran
with --clouds, the worst cases of each method before and after, and the true errors against the
deviations that a method expects of its points. Needs matplotlib and numpy (python3-matplotlib).
"""
import collections
import csv
import os
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from point_files import read_ply

WORST = 3
BINS = 10
OBLIQUE = np.array([[0.87, 0.50, 0.0], [0.17, -0.30, 0.94]])  # rows span the drawing plane


def read_rows(folder):
    """Rows by protocol and method, in the file's order."""
    rows = collections.defaultdict(lambda: collections.defaultdict(list))
    with open(os.path.join(folder, "cases.csv"), encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rows[row["protocol"]][row["method"]].append(row)
    return rows


def column(rows, name):
    return np.array([float(row[name]) for row in rows])


def save(figure, output, name):
    path = os.path.join(output, name.replace(":", "_"))
    for ending in ("png", "svg"):
        figure.savefig(f"{path}.{ending}", dpi=120, bbox_inches="tight",
                       metadata={"Date": None} if ending == "svg" else {})
    plt.close(figure)


def word(method):
    return re.sub("[^A-Za-z0-9+-]+", "_", method).strip("_")


def caption(axes, protocol, methods):
    row = next(iter(methods.values()))[0]
    axes.set_title(f"{protocol}: {row['data']}, {row['machine']}", fontsize=9)


def plot_organs(protocol, methods, output):
    organs = sorted({row["organ"] for rows in methods.values() for row in rows})
    figure, axes = plt.subplots(figsize=(2 + 1.2 * len(organs), 4))
    width = 0.8 / len(methods)
    for i, (method, rows) in enumerate(methods.items()):
        means = [column([row for row in rows if row["organ"] == organ], "rmse_mm").mean()
                 if any(row["organ"] == organ for row in rows) else np.nan for organ in organs]
        axes.bar(np.arange(len(organs)) + (i + 0.5) * width - 0.4, means, width, label=method)
    counts = collections.Counter(row["organ"] for row in next(iter(methods.values())))
    axes.set_xticks(range(len(organs)), [f"{organ}\n({counts[organ]})" for organ in organs])
    axes.set_ylabel("mean RMSE [mm]")
    axes.legend(fontsize=7, ncol=2)
    caption(axes, protocol, methods)
    save(figure, output, f"organs_{protocol}")


def plot_displacement(protocol, methods, output):
    figure, axes = plt.subplots(figsize=(6, 5))
    for method, rows in methods.items():
        axes.plot(column(rows, "before_mm"), column(rows, "rmse_mm"), ".", label=method, alpha=0.7)
    limit = max(column(rows, "before_mm").max() for rows in methods.values())
    axes.plot([0, limit], [0, limit], "k:", linewidth=1)
    axes.set_xlabel("RMS displacement before [mm]")
    axes.set_ylabel("RMSE after [mm]")
    axes.legend(fontsize=7)
    caption(axes, protocol, methods)
    save(figure, output, f"displacement_{protocol}")


def plot_time(protocol, methods, output):
    figure, axes = plt.subplots(figsize=(6, 4))
    for method, rows in methods.items():
        time, error = column(rows, "cpu_ms").mean(), column(rows, "rmse_mm").mean()
        axes.plot(max(time, 0.01), error, "o")
        axes.annotate(method, (max(time, 0.01), error), textcoords="offset points", xytext=(4, 4),
                      fontsize=7)
    axes.set_xscale("log")
    axes.set_xlabel("CPU time a case, one thread [ms]")
    axes.set_ylabel("mean RMSE [mm]")
    caption(axes, protocol, methods)
    save(figure, output, f"time_{protocol}")


def plot_shares(protocol, shares, output):
    """`shares`: methods and their rows, by percent in view."""
    metrics = [("mean RMSE [mm]", lambda rows: column(rows, "rmse_mm").mean()),
               ("worse than the start [% of cases]", lambda rows: 100 * np.mean(
                   column(rows, "rmse_mm") > column(rows, "before_mm"))),
               ("refused [% of cases]", lambda rows: 100 * column(rows, "refused").mean())]
    figure, panels = plt.subplots(1, len(metrics), figsize=(4 * len(metrics), 3.8),
                                  layout="constrained")
    percents = sorted(shares)
    for axes, (label, metric) in zip(panels, metrics):
        for method in shares[percents[0]]:
            axes.plot(percents, [metric(shares[percent][method]) for percent in percents], "o-",
                      label=method, alpha=0.8)
        axes.set_xticks(percents)
        axes.invert_xaxis()
        axes.set_ylim(bottom=0)
        axes.set_xlabel("surface in view [%]")
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize=7)
    caption(panels[1], protocol, shares[percents[0]])
    save(figure, output, f"shares_{protocol}")


def draw(axes, clouds, title):
    for cloud, colour in clouds:
        flat = cloud @ OBLIQUE.T
        axes.scatter(flat[:, 0], flat[:, 1], s=2, c=colour, linewidths=0)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(title, fontsize=7)


def plot_worst(protocol, method, rows, folder, output):
    """Target blue, source before and after red, true positions grey."""
    worst = sorted(rows, key=lambda row: -float(row["rmse_mm"]))[:WORST]
    figure, axes = plt.subplots(2, len(worst), figsize=(3.2 * len(worst), 6), squeeze=False)
    for i, row in enumerate(worst):
        case = os.path.join(folder, "clouds", protocol, f"{row['organ']}_{row['subject']}")
        target, truth = read_ply(f"{case}/target.ply"), read_ply(f"{case}/truth.ply")
        for line, (name, key) in enumerate([("source", "before_mm"),
                                            (f"moved by {method}", "rmse_mm")]):
            draw(axes[line, i], [(truth, "0.8"), (target, "tab:blue"),
                                 (read_ply(f"{case}/{name}.ply"), "tab:red")],
                 f"{row['organ']} {row['subject']}: {float(row[key]):.1f} mm")
    figure.suptitle(f"{protocol}, {method}: worst cases, before and after", fontsize=9)
    save(figure, output, f"worst_{protocol}_{word(method)}")


def read_deviations(folder, protocol, method, rows):
    """Expected deviations and true errors of all points of all cases that tell them [mm]."""
    expected, errors = [], []
    for row in rows:
        case = os.path.join(folder, "clouds", protocol, f"{row['organ']}_{row['subject']}")
        if os.path.exists(f"{case}/deviations of {method}.txt"):
            expected.append(np.loadtxt(f"{case}/deviations of {method}.txt"))
            errors.append(np.linalg.norm(read_ply(f"{case}/moved by {method}.ply") -
                                         read_ply(f"{case}/truth.ply"), axis=1))
    return np.concatenate(expected or [[]]), np.concatenate(errors or [[]])


def plot_calibration(method, protocols, output):
    """`protocols`: expected deviations and true errors by protocol, in bins of equal size."""
    def root_mean_square(values):
        return np.sqrt((values ** 2).mean())

    figure, axes = plt.subplots(figsize=(5, 5))
    limit = 0.0
    for protocol, (expected, errors) in protocols.items():
        bins = np.array_split(np.argsort(expected, kind="stable"), BINS)
        points = np.array([[root_mean_square(values[part]) for values in (expected, errors)]
                           for part in bins])
        whole = root_mean_square(errors) / root_mean_square(expected)
        axes.plot(*points.T, "o-", label=f"{protocol}: {whole:.2f} of it on the whole", alpha=0.8)
        limit = max(limit, 1.05 * points.max())
    axes.plot([0, limit], [0, limit], "k:", linewidth=1)
    axes.set_xlim(0, limit)
    axes.set_ylim(0, limit)
    axes.set_xlabel("standard deviation as the method has it [mm]")
    axes.set_ylabel("RMS error [mm]")
    axes.set_title(method, fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    save(figure, output, f"calibration_{word(method)}")


def main(folder, output=None):
    output = output or os.path.join(folder, "plots")
    os.makedirs(output, exist_ok=True)
    matplotlib.rcParams["svg.hashsalt"] = "unirit"  # the same rows give the same files
    colours = plt.cm.tab20([*range(0, 20, 2), *range(1, 20, 2)])  # ten as usual, then paler ones
    matplotlib.rcParams["axes.prop_cycle"] = plt.cycler(color=colours)
    shares, deviations = collections.defaultdict(dict), collections.defaultdict(dict)
    for protocol, methods in read_rows(folder).items():
        kind, _, percent = protocol.partition(":")
        if percent:
            shares[kind][float(percent)] = methods
        plot_organs(protocol, methods, output)
        plot_displacement(protocol, methods, output)
        plot_time(protocol, methods, output)
        if os.path.isdir(os.path.join(folder, "clouds", protocol)):
            for method, rows in methods.items():
                plot_worst(protocol, method, rows, folder, output)
                expected, errors = read_deviations(folder, protocol, method, rows)
                if expected.size:
                    deviations[method][protocol] = expected, errors
    for protocol, percents in shares.items():
        if len(percents) > 1:
            plot_shares(protocol, percents, output)
    for method, protocols in deviations.items():
        plot_calibration(method, protocols, output)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    if not os.path.exists(os.path.join(sys.argv[1], "cases.csv")):
        sys.exit(f"{sys.argv[1]}: holds no cases.csv; it is unirit_benchmark that writes one")
    main(*sys.argv[1:])
