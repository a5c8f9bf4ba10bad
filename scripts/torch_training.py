#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Usage: torch_training.py nearest|offsets --alpha A --cores N --batch N --points N --steps N
       --iterations N

Trains the networks of include/unirit/network/architecture.hpp by python's torch, on clouds of noise
that lie ready in memory, and prints pairs a second of the clock and a second of a core's time.
training_speed.py runs it with the environment in which it is fastest. Needs Debian's python3-torch.
"""
import argparse
import time

import torch
from torch import nn

ENCODER = [3, 64, 64, 64, 128, 1024]
RIGID_DECODER = [2048, 1024, 1024, 512, 512, 256, 7]
NONRIGID_DECODER = [2054, 1024, 512, 256, 128, 64, 3]
DECODED_POINTS = 64
FLOW_ENCODER = [64, 64, 64, 128, 256]
FLOW_SCALES = [0.8, 0.4, 0.2, 0.1]
FLOW_INPUTS, FLOW_TARGET_INPUTS = 83, 6
FLOW_DECODER = [FLOW_INPUTS + 512, 128, 128, 128, 22]
FLOW_FEWEST, FLOW_PLANE_RIDGE = 0.01, 0.05
FLOW_PLANES, FLOW_LENGTH, FLOW_PLANE_REACH, FLOW_PLANE_ROUNDING = 256, 0.4, 0.1, 1e-4
FLOW_VARIANCE, FLOW_RIGID_VARIANCE, FLOW_PLANE_VARIANCE = 0.15 ** 2, 0.5 ** 2, 0.08 ** 2
FLOW_COARSE_POINTS = 320
FLOW_COARSE_STEPS, FLOW_FINE_STEPS, FLOW_NONRIGID_STEPS = 3, 6, 3
PARAMETERS = {"nearest": 7466122, "offsets": 217302}


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

    covariance = FLOW_VARIANCE * closeness(point) * (normal @ normal.transpose(1, 2))
    covariance += FLOW_RIGID_VARIANCE * wrench @ wrench.transpose(1, 2)
    covariance.diagonal(0, 1, 2).mul_(1.0 + FLOW_PLANE_ROUNDING).add_(
        FLOW_PLANE_VARIANCE * (1.0 + offset.square().sum(2) / FLOW_PLANE_REACH ** 2))
    gains = torch.cholesky_solve((normal * offset).sum(2, True),
                                 torch.linalg.cholesky(covariance))
    motion = FLOW_RIGID_VARIANCE * (wrench.transpose(1, 2) @ gains).transpose(1, 2)
    turned = torch.cross(motion[:, :, 3:].expand_as(source), source, dim=2)
    return motion[:, :, :3] + turned + closeness(source) @ (FLOW_VARIANCE * gains * normal)


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
        matrix = (plane_squares / weight).unflatten(2, (3, 3)) + FLOW_PLANE_RIDGE * torch.eye(3)
        vectors += [forth / weight, back / (seen + FLOW_FEWEST), deformed / weight,
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


def published_losses(network, clouds, options):
    """Yields the loss of each update of a step."""
    source, target, truth, rigid = clouds
    moved = source
    for _ in range(options.iterations):
        moved = network["rigid"](moved, target)
        yield root_mean_square(moved - rigid)
        moved = moved.detach()
    if options.alpha > 0.0:
        some = moved[:, :DECODED_POINTS] + network["nonrigid"](moved, target)
        yield root_mean_square(some - truth[:, :DECODED_POINTS])


def flow_losses(network, clouds, options):
    """Yields the loss of each update of a step."""
    start, target, truth, _ = clouds
    stages = [(FLOW_COARSE_POINTS, FLOW_COARSE_STEPS)] * (options.iterations - 1) + \
        [(options.points, FLOW_FINE_STEPS), (options.points, FLOW_NONRIGID_STEPS)]
    for points, steps in stages:
        moved = start[:, :points]
        for _ in range(steps):
            reached = moved + network["flow"](start[:, :points], moved, target[:, :points])
            yield root_mean_square(reached - truth[:, :points])
            moved = reached.detach()
        start = best_rigid_fit(start[:, :points], moved, start)


def train(options):
    torch.set_num_threads(options.cores)
    torch.manual_seed(1)
    network = nn.ModuleDict({"rigid": Rigid(), "nonrigid": NonRigid()}
                            if options.pairing == "nearest" else {"flow": Flow()})
    assert sum(p.numel() for p in network.parameters()) == PARAMETERS[options.pairing]
    optimiser = torch.optim.Adam(network.parameters(), 1e-5)  # more would diverge on noise
    clouds = torch.rand(4, options.batch, options.points, 3) * 2 - 1
    losses = published_losses if options.pairing == "nearest" else flow_losses

    def steps(count):
        for _ in range(count):
            for loss in losses(network, clouds, options):
                optimiser.zero_grad(set_to_none=True)
                loss.backward()
                nn.utils.clip_grad_norm_(network.parameters(), 1.0)
                optimiser.step()
                loss.item()

    steps(options.steps // 3 + 1)  # to warm up
    start, start_used = time.perf_counter(), time.process_time()
    steps(options.steps)
    pairs = options.steps * options.batch
    print(pairs / (time.perf_counter() - start), pairs / (time.process_time() - start_used))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairing", choices=PARAMETERS)
    parser.add_argument("--alpha", type=float, required=True,
                        help="weight of the global loss; 0: the published rigid module alone")
    for option in ("--cores", "--batch", "--points", "--steps", "--iterations"):
        parser.add_argument(option, type=int, required=True)
    train(parser.parse_args())


if __name__ == "__main__":
    main()
