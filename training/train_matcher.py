#!/usr/bin/env python3
"""Trains the matcher on what the embedded extractor finds in rendered places (generate.py, extract.py).

  training/train_matcher.py --data runs/training/data --features runs/training/features -o runs/training/matcher

Writes what train.py writes, and is as repeatable.
"""
from pathlib import Path

import torch
import torch.nn.functional as F

from loop import Training, parser
from match_pairs import draw_pairs, load_places
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


class MatcherTraining(Training):
    fastest = 1e-3

    def __init__(self, arguments):
        places = load_places(arguments.data, arguments.features)
        super().__init__(arguments, Matcher, [p for seed, p in places.items() if seed < HELD_BACK],
                         [p for seed, p in places.items() if seed >= HELD_BACK])

    def pair_losses(self, pair):
        """After every layer; found after the last."""
        features = [pair[kind + side] for kind in ("keypoints_", "descriptors_") for side in "ab"]
        match, alone, found = zip(*(assignment_loss(self.network.assignment(*rows), pair)
                                    for rows in self.network.layers(*features)))
        return torch.stack(match), torch.stack(alone), found[-1]

    def backward(self):
        pairs = draw_pairs(self.places, self.arguments.seed, self.step, self.arguments.pairs)
        shown = []
        for pair in pairs:
            match, alone, found = self.pair_losses(pair)
            ((match.mean() + alone.mean()) / len(pairs)).backward()
            shown.append(torch.stack([match[-1], alone[-1], found]).detach())
        return dict(zip(("match", "alone", "found"), torch.stack(shown).mean(0)))

    def check(self):
        report = validate(self.network, self.held_back)
        return score(report), line(report)


if __name__ == "__main__":
    arguments = parser(__doc__)
    arguments.add_argument("--features", type=Path, required=True, help="what extract.py wrote")
    MatcherTraining(arguments.parse_args()).run()
