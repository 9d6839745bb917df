"""Training pairs of the matcher: keypoints of two pictures of one place, with who is whose partner.

Batch number `step` is a pure function of (seed, step): a resumed training sees what an uninterrupted one would have.
"""
import numpy as np
import torch

from matches import UNKNOWN, partners
from pairs import draw_pictures
from views import stereo_views

FEWEST, MOST = 128, 1024  # keypoints of a picture
FEWEST_MATCHES = 12


class Place:
    def __init__(self, rendered, extracted):
        packed, found = np.load(rendered), np.load(extracted)
        self.views = stereo_views(packed)
        self.pixels, self.descriptors = found["pixels"], found["descriptors"]
        self.visits_frames = self.pixels.shape[1:3]
        self.middle = np.array(packed["depth_m"].shape[:0:-1]) / 2  # of a picture, in pixels

    def view(self, picture):
        _, frame, side = picture
        return self.views[frame][side]

    def features(self, picture, copy=0, count=MOST):
        """The `count` best keypoints: pixels and descriptors."""
        pixels = self.pixels[copy, *picture].astype(float)
        count = min(count, np.isfinite(pixels[:, 0]).sum())
        return pixels[:count], self.descriptors[copy, *picture, :count].astype(np.float32)

    def normalised(self, pixels):
        """As the product hands them to a matcher."""
        return (pixels - self.middle) / self.middle.max()


def load_places(data, features):
    """By seed, those that extract.py has gone through."""
    files = sorted(features.glob("*[0-9].npz"), key=lambda f: int(f.stem))
    return {int(f.stem): Place(data / f.name, f) for f in files}


def draw_similarity(random):
    """Another camera's roll, zoom and middle: a linear map of normalised keypoints, and a shift."""
    angle, scale = random.normal(0.0, 0.08), np.exp(random.normal(0.0, 0.08))
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    return np.array([[c, -s], [s, c]]), random.normal(0.0, 0.05, 2)


def try_pair(random, place, count):
    """One pair of at most `count` keypoints each as a dict of arrays, or None where the pictures share too little."""
    extent = place.middle / place.middle.max()
    share = random.uniform(0.55, 1.0)  # of the picture's width and height that a narrower camera would have seen
    middle = random.uniform(share - 1.0, 1.0 - share, 2) * extent
    pictures, seen, pair = draw_pictures(random, *place.visits_frames), [], {}
    for name, picture in zip("ab", pictures):
        pixels, descriptors = place.features(picture, random.integers(len(place.pixels)))
        keypoints = (place.normalised(pixels) - middle) / share
        shown = np.nonzero((np.abs(keypoints) <= extent).all(1))[0][:count]
        linear, shift = draw_similarity(random)
        pair["keypoints_" + name] = (keypoints[shown] @ linear.T + shift).astype(np.float32)
        pair["descriptors_" + name] = descriptors[shown]
        seen.append(pixels[shown])
    if min(map(len, seen)) < FEWEST_MATCHES:
        return None
    pair["partner_a"], pair["partner_b"] = partners(*map(place.view, pictures), *seen)
    return pair if (pair["partner_a"] >= 0).sum() >= FEWEST_MATCHES else None


def draw_pair(random, places, count):
    while True:
        pair = try_pair(random, places[random.integers(len(places))], count)
        if pair:
            return pair


def stacked(rows, filling):
    """Arrays [N_i, ...] -> [pairs, N, ...], filled up to the longest."""
    result = np.full((len(rows), max(map(len, rows)), *rows[0].shape[1:]), filling, rows[0].dtype)
    for row, values in zip(result, rows):
        row[:len(values)] = values
    return torch.from_numpy(result)


def draw_batch(places, seed, step, pairs):
    """Tensors of `pairs` pairs, all with as many keypoints at most; real_a, real_b: which rows are not filling."""
    random = np.random.default_rng([seed, step])
    count = int(np.exp(random.uniform(np.log(FEWEST), np.log(MOST))))
    drawn = [draw_pair(random, places, count) for _ in range(pairs)]
    batch = {name: stacked([pair[name] for pair in drawn], UNKNOWN if "partner" in name else 0) for name in drawn[0]}
    real = {"real_" + side: stacked([np.ones(len(pair["partner_" + side]), bool) for pair in drawn], False)
            for side in "ab"}
    return {**batch, **real}
