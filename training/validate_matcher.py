#!/usr/bin/env python3
"""The matcher next to mutual nearest neighbours, on the same keypoints of held-back places, by exact truth.

  training/validate_matcher.py runs/training/matcher --data runs/training/data --features runs/training/features
"""
import argparse
from pathlib import Path

import numpy as np
import torch

from match_pairs import load_places
from matcher import Matcher, select
from matches import judge
from places import HELD_BACK
from validate import mutual_nearest

KEYPOINTS = 512
MIN_SCORE = 0.1  # the product's
RATIO = 0.9  # the product's, for nearest neighbours
FRAMES = (0, 1, 2)  # each with one some frames later
KINDS = {"stereo": (0, 0, 1), "drive 1": (0, 1, 0), "drive 2": (0, 2, 0), "drive 4": (0, 4, 0),
         "sun 30": (1, 2, 0), "sun 75": (2, 2, 0), "sun 180": (3, 2, 0)}  # visit, frames later, side


def learned(network):
    device = next(network.parameters()).device

    def match(place, pixels_a, pixels_b, rows_a, rows_b):
        features = place.normalised(pixels_a), place.normalised(pixels_b), rows_a, rows_b
        with torch.no_grad():
            matches, scores = select(network(*(torch.from_numpy(each).float().to(device) for each in features)))
        return matches[scores > MIN_SCORE].T.cpu().numpy()
    return match


def nearest(ratio):
    def match(place, pixels_a, pixels_b, rows_a, rows_b):
        i, j = mutual_nearest(rows_a, rows_b)
        best, second = np.sort(np.maximum(2 - 2 * rows_a[i] @ rows_b.T, 0), 1)[:, :2].T
        distinct = best < ratio ** 2 * second
        return i[distinct], j[distinct]
    return match


def count(match, place, a, b, keypoints):
    """(right matches, matches that can be judged) of two pictures."""
    (pixels_a, rows_a), (pixels_b, rows_b) = (place.features(p, count=keypoints) for p in (a, b))
    if min(len(pixels_a), len(pixels_b)) < 2:
        return 0, 0
    i, j = match(place, pixels_a, pixels_b, rows_a, rows_b)
    right, judged = judge(place.view(a), place.view(b), pixels_a[i], pixels_b[j])
    return right.sum(), judged.sum()


def compare(match, places, keypoints=KEYPOINTS):
    """Per kind of pair: mean right matches, and precision in percent."""
    report = {}
    for kind, (visit, later, side) in KINDS.items():
        counts = [count(match, p, (0, frame, 0), (visit, frame + later, side), keypoints)
                  for p in places for frame in FRAMES]
        right, judged = np.sum(counts, 0)
        report[kind] = (right / len(counts), 100.0 * right / max(judged, 1))
    return report


def validate(network, places):
    return compare(learned(network), places)


def score(report):
    """Right matches less wrong ones, over all kinds."""
    return sum(right * (2.0 - 100.0 / max(precision, 1.0)) for right, precision in report.values())


def line(report):
    return "; ".join(f"{kind}: {right:.0f} right, {precision:.0f} %" for kind, (right, precision) in report.items())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="the folder that train_matcher.py wrote")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--features", type=Path, required=True)
    parser.add_argument("--keypoints", type=int, default=KEYPOINTS, help="of each picture, at most")
    arguments = parser.parse_args()
    places = load_places(arguments.data, arguments.features)
    held_back = [p for seed, p in places.items() if seed >= HELD_BACK]
    network = Matcher()
    network.load_state_dict(torch.load(arguments.run / "best.pt", weights_only=True, map_location="cpu"))
    matchers = {"matcher": learned(network), "nearest": nearest(1.0), f"nearest, ratio {RATIO}": nearest(RATIO)}
    reports = [compare(match, held_back, arguments.keypoints) for match in matchers.values()]
    print("| pairs | " + " | ".join(matchers) + " |\n| --- |" + " --- |" * len(matchers))
    for kind in KINDS:
        print(f"| {kind} | " + " | ".join("{:.0f} right, {:.0f} %".format(*report[kind]) for report in reports) + " |")


if __name__ == "__main__":
    main()
