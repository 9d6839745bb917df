#!/usr/bin/env python3
"""Trains the matcher on what the embedded extractor finds in rendered places (generate.py, extract.py).

  training/train_matcher.py --data runs/training/data --features runs/training/features -o runs/training/matcher

Writes what train.py writes, and is as repeatable; --threads is how many pairs are worked on at the same time, each by
a process of its own.
"""
import multiprocessing
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

from loop import Training, parser
from match_pairs import draw_pair, load_places
from matcher import Matcher
from matches import NONE
from places import HELD_BACK
from validate_matcher import line, score, validate


def no_partner(logits, partner):
    """Negative log likelihood of having none, of those that have none."""
    alone = partner == NONE
    return (F.softplus(logits) * alone).sum() / alone.sum().clamp(min=1)


def assignment_loss(assignment, pair):
    """Of the true partners and of the points without one, as in the paper; and which partners are found."""
    log, has_a, has_b = assignment
    partner = pair["partner_a"]
    matched = partner >= 0
    true = log[matched.nonzero()[:, 0], partner[matched]]
    alone = (no_partner(has_a, partner) + no_partner(has_b, pair["partner_b"])) / 2
    found = (log.argmax(1) == partner)[matched].float().mean()
    return -true.mean(), alone, found


def begin_work(*shared):
    global worker
    worker = shared
    torch.set_num_threads(1)


def gradients(seed, step, number):
    """Of one pair's loss after every layer, in one row; what the log shows is of the last layer."""
    network, places = worker
    pair = {name: torch.from_numpy(values) for name, values in draw_pair(places, seed, step, number).items()}
    features = [pair[kind + side] for kind in ("keypoints_", "descriptors_") for side in "ab"]
    layers = [assignment_loss(network.assignment(*rows), pair) for rows in network.layers(*features)]
    loss = sum(match + alone for match, alone, _ in layers) / len(layers)
    parts = torch.autograd.grad(loss, list(network.parameters()))
    return torch.cat([part.flatten() for part in parts]).numpy(), torch.stack(layers[-1]).detach().numpy()


class MatcherTraining(Training):
    fastest = 2e-3

    def __init__(self, arguments):
        places = load_places(arguments.data, arguments.features)
        super().__init__(arguments, Matcher, [p for seed, p in places.items() if seed < HELD_BACK],
                         [p for seed, p in places.items() if seed >= HELD_BACK])
        torch.set_num_threads(1)
        shared = self.network.share_memory(), self.places
        self.pool = multiprocessing.get_context("fork").Pool(arguments.threads, begin_work, shared)

    def backward(self):
        pairs = [(self.arguments.seed, self.step, number) for number in range(self.arguments.pairs)]
        rows, shown = (np.mean(each, 0) for each in zip(*self.pool.starmap(gradients, pairs, 1)))
        parameters = list(self.network.parameters())
        for parameter, part in zip(parameters, torch.from_numpy(rows).split([p.numel() for p in parameters])):
            parameter.grad = part.view_as(parameter)
        return dict(zip(("match", "alone", "found"), shown))

    def check(self):
        report = validate(self.network, self.held_back)
        return score(report), line(report)


if __name__ == "__main__":
    arguments = parser(__doc__)
    arguments.add_argument("--features", type=Path, required=True, help="what extract.py wrote")
    MatcherTraining(arguments.parse_args()).run()
