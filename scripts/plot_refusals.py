#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Tells what the plausibility checks refused: plot_refusals.py FOLDER [--plots DIR] [--set-limits]

FOLDER is the --output of unirit_refusals. Prints a Markdown table of what was refused and what was
let through, with 95 % confidence intervals (Wilson 1927), and which check refused first. --plots
draws refusals.png and refusals.svg, what is let through against what is refused falsely as all
limits are scaled together, into DIR. --set-limits draws new limits from these registrations, prints
them and writes them into the source tree that this script lies in (or --tree): only ever do that
with training organs. Needs numpy and matplotlib (python3-matplotlib).
"""
import argparse
import csv
import os
import re
import sys

import numpy as np

FALSE_REFUSALS = 0.015  # aimed at with --set-limits
QUANTILE = 0.998        # of right registrations that keep to a limit
ROOM = 1.25             # beyond that, of limits that tell little by themselves
FIRST_KIND = ("other organ", "table top", "wrong unit")
SECOND_KIND = ("far start", "small view", "half other")

# By design: how far a start may be off, how little of an organ may be in view
DESIGNED = ["turn from the start [degree]", "share in view that is missing", "mean confidence"]
# Setting of each check whose limit is drawn from registrations
SETTINGS = {
    "95th percentile of the surface residual over extent": "max_residual_p95",
    "surprise of the displacement": "max_surprise",
    "gain in fit of the organ flipped": "max_flip_gain",
    "largest displacement over extent": "max_displacement",
    "stretch": "max_stretch",
    "compression": "min_compression",
    "residual over that of the rigid part": "max_residual_left",
    "overlap of the cloud with the predicted region": "min_overlap",
}
TELLING = ["95th percentile of the surface residual over extent", "surprise of the displacement",
           "gain in fit of the organ flipped"]
# What the joint check is made of
JOINT = DESIGNED + TELLING[:2] + ["largest displacement over extent"]
JOINT_NAME = "joint closeness to the limits"


def read_table(path):
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


class Registrations:
    """The rows of a folder; values and closeness to the limits as arrays, NaN where not checked."""

    def __init__(self, folder):
        rows = read_table(os.path.join(folder, "registrations.csv"))
        limits = read_table(os.path.join(folder, "limits.csv"))
        self.kind = np.array([row["kind"] for row in rows])
        self.protocol = np.array([row["protocol"] for row in rows])
        self.refused = np.array([row["status"] != "SUCCEEDED" for row in rows])
        # What was refused before it was registered would have had no error
        self.right = np.array([row["right"] == "yes" or row["rmse_mm"] == "" and
                               row["kind"] == "ordinary" for row in rows])
        self.checks = [limit["check"] for limit in limits]
        self.limits = np.array([float(limit["limit"]) for limit in limits])
        self.at_least = np.array([limit["at_least"] == "yes" for limit in limits])
        self.values = np.array([[float(row[name] or "nan") for name in self.checks]
                                for row in rows])

    def closeness(self):
        """Value over limit, inverted for lower limits: above 1 the check failed."""
        over, under = (np.where(self.at_least, self.limits, self.values),
                       np.where(self.at_least, self.values, self.limits))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(over <= 0.0, 0.0, over / under)

    def worst(self):
        """The largest closeness of each row: refused above 1."""
        return np.nanmax(np.where(np.isnan(self.values), -np.inf, self.closeness()), axis=1)

    def first_refusal(self, row):
        failed = [name for name, closeness in zip(self.checks, self.closeness()[row])
                  if closeness > 1.0]
        return failed[0] if failed else "other"


def wilson(count, total):
    """Share and its 95 % interval in percent."""
    if total == 0:
        return float("nan"), float("nan"), float("nan")
    z, share = 1.96, count / total
    centre = (share + z * z / (2 * total)) / (1 + z * z / total)
    half = z / (1 + z * z / total) * np.sqrt(share * (1 - share) / total + z * z / (4 * total**2))
    return 100 * share, 100 * max(0.0, centre - half), 100 * min(1.0, centre + half)


def line(name, attempts, counted, mask):
    return "| {} | {} | {} | {} | {:.1f} % ({:.1f} to {:.1f}) |".format(
        name, attempts, counted, mask.sum(), *wilson(mask.sum(), counted))


def print_table(data):
    print("| registrations | attempts | of them right | refused all the same | share |")
    print("|---|---|---|---|---|")
    ordinary = data.kind == "ordinary"
    groups = [(name, ordinary & (data.protocol == name))
              for name in dict.fromkeys(data.protocol[ordinary])]
    for name, rows in groups + [("all ordinary", ordinary)]:
        print(line(name, rows.sum(), (rows & data.right).sum(), data.refused[rows & data.right]))
    print("\n| failures | attempts | of them wrong | let through | share |")
    print("|---|---|---|---|---|")
    groups = [(name, data.kind == name) for name in FIRST_KIND + SECOND_KIND]
    groups += [("all of the first three", np.isin(data.kind, FIRST_KIND)),
               ("all of the last three", np.isin(data.kind, SECOND_KIND)),
               ("all failures", ~ordinary), ("ordinary, gone wrong", ordinary)]
    for name, rows in groups:
        wrong = rows & ~data.right
        print(line(name, rows.sum(), wrong.sum(), ~data.refused[wrong]))
    print("\n| check that refused first | failures | ordinary, right |")
    print("|---|---|---|")
    first = {row: data.first_refusal(row) for row in np.flatnonzero(data.refused)}
    for name in data.checks + ["other"]:
        failures = sum(value == name and not data.right[row] for row, value in first.items())
        falsely = sum(value == name and data.right[row] and ordinary[row]
                      for row, value in first.items())
        if failures + falsely > 0:
            print(f"| {name} | {failures} | {falsely} |")


def curve(right, wrong):
    """Shares refused of the right and let through of the wrong, as the limits are scaled."""
    scales = np.unique(np.concatenate([right, wrong]))[::-1]
    return (np.array([100 * (right > scale).mean() for scale in scales]),
            np.array([100 * (wrong <= scale).mean() for scale in scales]))


def plot(data, folder):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    matplotlib.rcParams["svg.hashsalt"] = "unirit"  # the same rows give the same files
    worst = data.worst()
    right = worst[(data.kind == "ordinary") & data.right]
    figure, axes = plt.subplots(figsize=(6, 4.5))
    kinds = list(FIRST_KIND + SECOND_KIND)
    for name, rows in [(kind, data.kind == kind) for kind in kinds] + [
            ("all failures", data.kind != "ordinary")]:
        wrong = worst[rows & ~data.right]
        if len(wrong) == 0:
            continue
        style = {"color": "k", "linewidth": 2} if name == "all failures" else {"linewidth": 1.2}
        drawn = axes.step(*curve(right, wrong), where="post", label=f"{name} ({len(wrong)})",
                          **style)[0]
        axes.plot(100 * (right > 1.0).mean(), 100 * (wrong <= 1.0).mean(), "o",
                  color=drawn.get_color(), markersize=5)
    axes.axhline(5.0, color="0.7", linestyle=":")
    axes.axvline(3.0, color="0.7", linestyle=":")
    axes.set_xlim(0, 10)
    axes.set_ylim(0, 25)
    axes.set_xlabel(f"right registrations refused [%] (of {len(right)})")
    axes.set_ylabel("wrong registrations let through [%]")
    axes.legend(fontsize=8)
    os.makedirs(folder, exist_ok=True)
    for ending in ("png", "svg"):
        figure.savefig(os.path.join(folder, f"refusals.{ending}"), dpi=120, bbox_inches="tight",
                       metadata={"Date": None} if ending == "svg" else {})


def round_up(value, at_least):
    """Three digits, away from what should pass."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (np.floor(np.log10(abs(value))) - 2)
    return float(np.floor(value / unit) * unit if at_least else np.ceil(value / unit) * unit)


def draw_limits(data):
    """New limits by the names of their settings."""
    right = (data.kind == "ordinary") & data.right & ~np.isnan(data.values[:, -1])
    for i, name in enumerate(data.checks):
        if name not in SETTINGS:
            continue
        low = data.at_least[i]
        limit = np.quantile(data.values[right, i], 1.0 - QUANTILE if low else QUANTILE)
        if name not in TELLING:
            limit *= 1.0 / ROOM if low else ROOM
        data.limits[i] = max(0.0, round_up(limit, low))
    columns = [data.checks.index(name) for name in JOINT]
    joint = data.checks.index(JOINT_NAME)
    closeness = data.closeness()[right]
    together = np.sqrt((closeness[:, columns] ** 2).mean(axis=1))
    kept = np.delete(closeness, joint, axis=1).max(axis=1) <= 1.0
    drop = max(0, int(FALSE_REFUSALS * right.sum()) - (~kept).sum())
    data.limits[joint] = round_up(np.sort(together[kept])[-1 - drop], False)
    return {setting: f"{data.limits[data.checks.index(name)]:g}"
            for name, setting in {**SETTINGS, JOINT_NAME: "max_joint"}.items()}


def write_limits(limits, tree):
    """Into the four places where defaults stand; comments behind them stay in their column."""
    number = r"([0-9.e+-]+)"
    places = {
        "include/unirit/settings.hpp": rf"(  double {{}} = ){number}(;)( *)",
        "config/unirit.yaml": rf"(\n  {{}}: ){number}()( *)",
        "README.md": rf"(\| `plausibility/{{}}` \| ){number}( \|)()",
        "cfg/Unirit.cfg": rf'(gen\.add\("{{}}",(?:(?!gen\.add).)*?,\s+){number}'
                          r"(, [0-9.]+, [0-9.]+\))()",
    }
    for path, pattern in places.items():
        path = os.path.join(tree, path)
        with open(path, encoding="utf-8") as file:
            text = file.read()
        for setting, limit in limits.items():
            def replaced(match):
                head, old, tail, gap = match.groups()
                gap = " " * max(2, len(gap) + len(old) - len(limit)) if gap else ""
                return head + limit + tail + gap
            text, count = re.subn(pattern.format(setting), replaced, text, flags=re.DOTALL)
            if count != 1:
                sys.exit(f"plot_refusals.py: {path} has {count} defaults of {setting}, not one")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--plots", metavar="DIR")
    parser.add_argument("--set-limits", action="store_true")
    parser.add_argument("--tree", metavar="DIR",
                        default=os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    arguments = parser.parse_args()
    try:
        data = Registrations(arguments.folder)
    except (OSError, KeyError, ValueError) as error:
        sys.exit(f"plot_refusals.py: {arguments.folder} is no output of unirit_refusals: {error}")
    print_table(data)
    if arguments.plots:
        plot(data, arguments.plots)
    if arguments.set_limits:
        limits = draw_limits(data)
        print("\nplausibility:")
        for setting, limit in limits.items():
            print(f"  {setting}: {limit}")
        write_limits(limits, arguments.tree)


if __name__ == "__main__":
    main()
