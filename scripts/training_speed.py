#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Usage: training_speed.py UNIRIT_TRAIN [--cores N...] [--batch N] [--points N] [--steps N]
       [--iterations N] [--repeats N]

Trains networks by UNIRIT_TRAIN and by python's torch in turn, on the same cores, and prints a
Markdown table of the medians of their speeds, in pairs a second of the clock and a second of a
core's time, which other work on the machine disturbs less: the published rigid module, both
published modules, and the flow module. The python side has the same layers, batch, points, loss,
iterations, an optimiser step after each of them, as many decoded points, and the decoder's global
columns once a pair. Its clouds lie ready in memory; unirit_train makes its pairs meanwhile, on the
same cores.

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

ENCODER = [3, 64, 64, 64, 128, 1024]
RIGID_DECODER = [2048, 1024, 1024, 512, 512, 256, 7]
NONRIGID_DECODER = [2054, 1024, 512, 256, 128, 64, 3]
DECODED_POINTS = 64
FLOW_ENCODER = [64, 64, 64, 128, 256]
FLOW_SCALES = [0.8, 0.4, 0.2, 0.1]
FLOW_INPUTS, FLOW_TARGET_INPUTS = 83, 6
FLOW_DECODER = [FLOW_INPUTS + 512, 128, 128, 128, 22]
FLOW_PLANES, FLOW_LENGTH = 256, 0.4
FLOW_COARSE_POINTS, FLOW_COARSE_STEPS, FLOW_FINE_STEPS = 320, 3, 6
PARAMETERS = {"nearest": 7466122, "offsets": 217302}
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
    """Pairs a second, and a second of a core, once the rigid iterations have grown: of the second
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


def speed_of_torch(options, phase, cores):
    with start_on(cores, [
            sys.executable, os.path.abspath(__file__), options.unirit_train, "--torch", phase,
            "--cores", str(len(cores)), "--batch", str(options.batch), "--points",
            str(options.points), "--steps", str(options.steps), "--iterations",
            str(options.iterations)], OPENBLAS_NUM_THREADS=str(len(cores))) as train:
        output = train.stdout.read()
    if train.returncode != 0:
        sys.exit("python's torch failed")
    return tuple(float(number) for number in output.split())


def train_with_torch(options):
    """Prints pairs a second, and a second of a core, after a third as many steps to warm up."""
    import torch  # pylint: disable=import-outside-toplevel
    from torch import nn  # pylint: disable=import-outside-toplevel

    def layers(widths):
        made = nn.ModuleList(nn.Linear(*pair) for pair in zip(widths, widths[1:]))
        for layer in made:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)
        return made

    def run_layers(made, values):
        for layer in made[:-1]:
            values = torch.relu(layer(values))
        return made[-1](values)

    class Encoder(nn.Module):
        def __init__(self, widths=tuple(ENCODER)):
            super().__init__()
            self.layers = layers(widths)

        def forward(self, points):  # the maximum commutes with the ReLU
            return torch.relu(run_layers(self.layers, points).max(1).values)

    class Rigid(nn.Module):
        def __init__(self):
            super().__init__()
            self.source, self.target, self.decoder = Encoder(), Encoder(), layers(RIGID_DECODER)
            self.decoder[-1].weight.data *= 0.05
            self.decoder[-1].bias.data[0] = 1.0

        def forward(self, moved, target):
            features = torch.cat([self.source(moved), self.target(target)], 1)
            output = run_layers(self.decoder, features)
            w, x, y, z = nn.functional.normalize(output[:, :4]).unbind(1)
            rotation = torch.stack(
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1)
            rotation = rotation.view(-1, 3, 3)
            return torch.baddbmm(output[:, 4:].unsqueeze(1), moved, rotation.transpose(1, 2))

    class NonRigid(nn.Module):
        def __init__(self):
            super().__init__()
            self.source, self.target, self.decoder = Encoder(), Encoder(), layers(NONRIGID_DECODER)

        def forward(self, moved, target):
            features = torch.cat([self.source(moved), self.target(target)], 1)
            with torch.no_grad():
                index = torch.cdist(moved, target).argmin(2)
            some = moved[:, :DECODED_POINTS]
            offset = target.gather(1, of_points(index[:, :DECODED_POINTS])) - some
            first = self.decoder[0]
            point, columns, pairing = first.weight.split([3, 2048, 3], 1)
            values = nn.functional.linear(torch.cat([some, offset], 2),
                                          torch.cat([point, pairing], 1))
            values = values + nn.functional.linear(features, columns, first.bias).unsqueeze(1)
            return run_layers(self.decoder[1:], torch.relu(values))

    def normals_of(points):
        kernel = (torch.cdist(points, points).square() * (-0.5 / FLOW_SCALES[-1] ** 2)).exp()
        weights = kernel / kernel.sum(2, True)
        mean = weights @ points
        squares = weights @ (points.unsqueeze(3) * points.unsqueeze(2)).flatten(2)
        covariance = squares.unflatten(2, (3, 3)) - mean.unsqueeze(3) * mean.unsqueeze(2)
        return torch.linalg.eigh(covariance)[1][:, :, :, 0]

    def coherent_way(source, target, normals, nearest):
        count = min(FLOW_PLANES, target.shape[1])
        chosen = torch.arange(count) * target.shape[1] // count
        normal = normals[:, chosen]
        point = source.gather(1, of_points(nearest[:, chosen]))
        offset = target[:, chosen] - point
        wrench = torch.cat([normal, torch.cross(point, normal, dim=2)], 2)

        def closeness(points):
            return (torch.cdist(points, point).square() * (-0.5 / FLOW_LENGTH ** 2)).exp()

        covariance = 0.0225 * closeness(point) * (normal @ normal.transpose(1, 2))
        covariance += 0.25 * wrench @ wrench.transpose(1, 2)
        covariance.diagonal(0, 1, 2).mul_(1.0001).add_(
            0.0064 * (1.0 + offset.square().sum(2) / 0.01))
        gains = torch.cholesky_solve((normal * offset).sum(2, True),
                                     torch.linalg.cholesky(covariance))
        motion = 0.25 * (wrench.transpose(1, 2) @ gains).transpose(1, 2)
        turned = torch.cross(motion[:, :, 3:].expand_as(source), source, dim=2)
        return motion[:, :, :3] + turned + closeness(source) @ (0.0225 * gains * normal)

    def surroundings(source, deformation, target):
        distances = torch.cdist(source, target)
        of_source = of_points(distances.argmin(2))
        to_target = target.gather(1, of_source) - source
        target_normals = normals_of(target)
        normals = target_normals.gather(1, of_source)
        to_plane = normals * (normals * to_target).sum(2, True)
        planes = (normals.unsqueeze(3) * normals.unsqueeze(2)).flatten(2)
        nearest = distances.argmin(1)
        to_source = source.gather(1, of_points(nearest)) - target
        count = torch.zeros_like(source[:, :, :1]).scatter_add_(
            1, nearest.unsqueeze(2), torch.ones_like(target[:, :, :1]))
        total = torch.zeros_like(source).scatter_add_(1, of_points(nearest), -to_source)
        values = torch.cat([to_target, total, count, torch.ones_like(count), deformation, to_plane,
                            planes], 2)
        squares = torch.cdist(source, source).square()
        kernel = (squares * (-0.5 / FLOW_SCALES[0] ** 2)).exp()
        way = coherent_way(source, target, target_normals, nearest)
        vectors, inputs = [to_target, deformation, way], [source]
        for scale in FLOW_SCALES:
            if scale < FLOW_SCALES[0]:
                kernel = kernel.square().square()
            forth, back, seen, weight, deformed, plane_sum, plane_squares = torch.bmm(
                kernel, values).split([3, 3, 1, 1, 3, 3, 9], 2)
            matrix = (plane_squares / weight).unflatten(2, (3, 3)) + 0.05 * torch.eye(3)
            vectors += [forth / weight, back / (seen + 0.01), deformed / weight,
                        torch.linalg.solve(matrix, (plane_sum / weight).unsqueeze(3)).squeeze(3)]
            inputs.append(seen / weight * source.shape[1] / target.shape[1])
        vectors = torch.stack(vectors, 2)
        return (torch.cat(inputs + [vectors.flatten(2), vectors.norm(dim=3)], 2), vectors,
                torch.cat([target, to_source], 2))

    class Flow(nn.Module):
        def __init__(self):
            super().__init__()
            self.source = Encoder([FLOW_INPUTS] + FLOW_ENCODER)
            self.target = Encoder([FLOW_TARGET_INPUTS] + FLOW_ENCODER)
            self.decoder = layers(FLOW_DECODER)
            self.decoder[-1].weight.data *= 0.005

        def forward(self, start, moved, target):
            with torch.no_grad():
                of_source, vectors, of_target = surroundings(
                    moved, moved - best_rigid_fit(start, moved, start), target)
            features = torch.cat([self.source(of_source), self.target(of_target)], 1)
            first = self.decoder[0]
            point, columns = first.weight.split([FLOW_INPUTS, 512], 1)
            values = nn.functional.linear(of_source, point)
            values = values + nn.functional.linear(features, columns, first.bias).unsqueeze(1)
            output = run_layers(self.decoder[1:], torch.relu(values))
            return output[:, :, :3] + (output[:, :, 3:].unsqueeze(3) * vectors).sum(2)

    def best_rigid_fit(source, moved, points):
        source_centre, centre = source.mean(1, True), moved.mean(1, True)
        covariance = (source - source_centre).transpose(1, 2) @ (moved - centre)
        u, _, vt = torch.linalg.svd(covariance.double(), full_matrices=False)
        v = vt.transpose(1, 2).clone()
        v[:, :, 2] *= torch.linalg.det(u @ vt).sign().unsqueeze(1)
        rotation = (v @ u.transpose(1, 2)).float()
        return (points - source_centre) @ rotation.transpose(1, 2) + centre

    def of_points(index):
        return index.unsqueeze(2).expand(-1, -1, 3)

    def root_mean_square(offsets):
        return (offsets.square().sum(2).mean(1) + 1e-12).sqrt().mean()

    torch.set_num_threads(options.cores[0])
    torch.manual_seed(1)
    pairing, alpha = PHASES[options.torch]
    network = nn.ModuleDict({"rigid": Rigid(), "nonrigid": NonRigid()}
                            if pairing == "nearest" else {"flow": Flow()})
    assert sum(p.numel() for p in network.parameters()) == PARAMETERS[pairing]
    optimiser = torch.optim.Adam(network.parameters(), 1e-5)  # more would diverge on noise
    source, target, truth, rigid = torch.rand(4, options.batch, options.points, 3) * 2 - 1

    def update(loss):
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        return loss.item()

    def step_published():
        moved = source
        for _ in range(options.iterations):
            moved = network["rigid"](moved, target)
            update(root_mean_square(moved - rigid))
            moved = moved.detach()
        if alpha > 0.0:
            some = moved[:, :DECODED_POINTS] + network["nonrigid"](moved, target)
            update(root_mean_square(some - truth[:, :DECODED_POINTS]))

    def step_flow():
        start = source
        for i in range(options.iterations + 1):  # the last is the non-rigid stage
            coarse = i < options.iterations - 1
            read = slice(FLOW_COARSE_POINTS if coarse else None)
            moved = start[:, read]
            for _ in range(FLOW_COARSE_STEPS if coarse else FLOW_FINE_STEPS):
                reached = moved + network["flow"](start[:, read], moved, target[:, read])
                update(root_mean_square(reached - truth[:, read]))
                moved = reached.detach()
            start = best_rigid_fit(start[:, read], moved, start)

    step = step_published if pairing == "nearest" else step_flow
    for _ in range(options.steps // 3 + 1):
        step()
    start, start_used = time.perf_counter(), time.process_time()
    for _ in range(options.steps):
        step()
    pairs = options.steps * options.batch
    print(pairs / (time.perf_counter() - start), pairs / (time.process_time() - start_used))


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
            speeds = [speed_of_torch(options, phase, cores) + speed_of_unirit(options, phase, cores)
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
    parser.add_argument("--torch", choices=PHASES, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.torch:
        train_with_torch(options)
    else:
        compare(options)


if __name__ == "__main__":
    main()
