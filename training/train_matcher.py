#!/usr/bin/env python3
"""Trains the matcher on what the extractor finds in rendered places (generate.py, extract.py).

  training/train_matcher.py --data runs/training/data --features runs/training/features -o runs/training/matcher

Writes what train.py writes, and is as repeatable.
"""
from pathlib import Path

import torch.nn.functional as F

from loop import Training, parser
from match_pairs import draw_batch, load_places
from matcher import Matcher
from matches import NONE
from places import HELD_BACK
from validate_matcher import line, score, validate


def mean_over_pairs(values, which):
    """Of the values [pairs, N] that count: the mean of each pair, and of these."""
    return ((values * which).sum(1) / which.sum(1).clamp(min=1)).mean()


def assignment_loss(assignment, batch):
    """Of the true partners and of the points without one, as in the paper; and which partners are found."""
    log, has_a, has_b = assignment
    partner = batch["partner_a"]
    matched = partner >= 0
    true = log.gather(2, partner.clamp(min=0)[..., None])[..., 0]
    alone = (mean_over_pairs(F.softplus(has_a), partner == NONE)
             + mean_over_pairs(F.softplus(has_b), batch["partner_b"] == NONE)) / 2
    found = mean_over_pairs((log.argmax(2) == partner).float(), matched)
    return {"match": -mean_over_pairs(true, matched), "alone": alone, "found": found}


class MatcherTraining(Training):
    fastest = 2e-3

    def __init__(self, arguments):
        places = load_places(arguments.data, arguments.features)
        super().__init__(arguments, Matcher, [p for seed, p in places.items() if seed < HELD_BACK],
                         [p for seed, p in places.items() if seed >= HELD_BACK])

    def draw(self, step):
        return draw_batch(self.places, self.arguments.seed, step, self.arguments.pairs)

    def backward(self, batch):
        real = batch["real_a"], batch["real_b"]
        features = [batch[kind + side] for kind in ("keypoints_", "descriptors_") for side in "ab"]
        layers = [assignment_loss(self.network.assignment(*rows, *real), batch)
                  for rows in self.network.layers(*features, *real)]
        (sum(each["match"] + each["alone"] for each in layers) / len(layers)).backward()
        return layers[-1]

    def check(self):
        report = validate(self.network, self.held_back)
        return score(report), line(report)


if __name__ == "__main__":
    arguments = parser(__doc__)
    arguments.add_argument("--features", type=Path, required=True, help="what extract.py wrote")
    MatcherTraining(arguments.parse_args()).run()
