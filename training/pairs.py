"""Training pairs: two crops of one place, augmented, with exact correspondences and the teacher's keypoints.

Batch number `step` is a pure function of (seed, step): a resumed training sees what an uninterrupted one would have.
"""
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from views import stereo_views, transfer

CROP = 160
POINTS = 256  # correspondences per pair
REPEATS_PX = 1.5
SPOT_PX = 0.7  # of a keypoint in the target


class Place:
    def __init__(self, file):
        packed = np.load(file)
        self.images = np.stack([packed["left"], packed["right"]], 2)  # [visit, frame, side, row, column]
        self.views = stereo_views(packed)
        self.corners = packed["corners"]  # [visit, frame, side, N, 2], the last ones nan

    def corners_in(self, picture, into):
        """Those that the crop `into` shows."""
        found = self.corners[picture]
        found = found[np.isfinite(found[:, 0])].astype(float)
        return found[inside(into(found), 0)]


@dataclass
class Similarity:
    """Picture -> crop: turned, scaled, the picture's `centre` in the crop's middle."""
    centre: np.ndarray
    scale: float
    angle: float

    def matrix(self):
        c, s = np.cos(self.angle), np.sin(self.angle)
        return self.scale * np.array([[c, -s], [s, c]])

    def __call__(self, pixels):
        return (pixels - self.centre) @ self.matrix().T + (CROP - 1) / 2

    def cut(self, image):
        v, u = np.mgrid[:CROP, :CROP]
        back = (np.stack([u, v], -1) - (CROP - 1) / 2) @ np.linalg.inv(self.matrix()).T + self.centre
        grid = torch.from_numpy(2 * back / (np.array(image.shape[::-1]) - 1) - 1).float()[None]
        grey = torch.from_numpy(image.astype(np.float32))[None, None] / 255
        return F.grid_sample(grey, grid, padding_mode="border", align_corners=True)[0]


def draw_similarity(random, centre):
    return Similarity(centre, np.exp(random.normal(0.0, 0.15)), random.normal(0.0, 0.12))


def relit(random, crop):
    """Another exposure, contrast, gamma, blur, shadow of the rover, and noise; saturates."""
    if random.random() < 0.3:
        crop = F.avg_pool2d(F.pad(crop, (1, 1, 1, 1), mode="replicate"), 3, 1)
    crop = crop.clamp(0, 1) ** float(np.exp(random.normal(0.0, 0.25)))
    if random.random() < 0.15:
        crop = crop * shadow(random, *crop.shape[-2:])
    crop = crop * float(np.exp(random.normal(0.0, 0.35))) + float(random.normal(0.0, 0.05))
    noise = torch.from_numpy(random.standard_normal(crop.shape, np.float32)) * float(random.uniform(0.0, 0.025))
    return (crop + noise).clamp(0, 1)


def shadow(random, height, width):
    """Dark on one side of a straight edge."""
    v, u = np.mgrid[:height, :width] / max(height, width) - 0.5
    angle = random.uniform(0, 2 * np.pi)
    dark = np.cos(angle) * u + np.sin(angle) * v > random.uniform(0.1, 0.4)
    return torch.from_numpy(np.where(dark, random.uniform(0.05, 0.5), 1.0).astype(np.float32))


def inside(pixels, margin=4):
    return ((pixels >= margin) & (pixels <= CROP - 1 - margin)).all(1)


def heat_target(pixels, weights):
    """[65, cells, cells]: each keypoint a Gaussian, whose logarithm is the parabola that the product fits."""
    cells = CROP // 8
    heat = np.zeros((CROP + 6, CROP + 6), np.float32)  # a border of three takes what falls outside
    whole = np.rint(pixels).astype(int)
    for dv, du in np.ndindex(5, 5):
        at = whole + (du - 2, dv - 2)
        spot = np.exp(-((at - pixels) ** 2).sum(1) / (2 * SPOT_PX ** 2)) / (2 * np.pi * SPOT_PX ** 2)
        np.maximum.at(heat, (at[:, 1] + 3, at[:, 0] + 3), weights * spot)
    heat = heat[3:-3, 3:-3]
    by_cell = heat.reshape(cells, 8, cells, 8).transpose(1, 3, 0, 2).reshape(64, cells, cells)
    mass = by_cell.sum(0, keepdims=True)
    by_cell = by_cell / np.maximum(mass, 1.0)
    return np.concatenate([by_cell, np.maximum(1.0 - mass, 0.0)])


def repeated(a, b, corners_a, corners_b):
    """Per corner of a: seen by b, and its nearest corner there when that is near enough (-1: none)."""
    there, seen = transfer(a, b, corners_a)
    if len(corners_b) == 0:
        return seen, np.full(len(seen), -1)
    there = np.where(seen[:, None], there, -1e3)
    squared = (there ** 2).sum(1)[:, None] + (corners_b ** 2).sum(1) - 2 * there @ corners_b.T
    nearest = squared.argmin(1)
    found = seen & (squared[np.arange(len(there)), nearest] < REPEATS_PX ** 2)
    return seen, np.where(found, nearest, -1)


def corner_weights(seen, partner, same_light):
    """1: found again; what b cannot see is not judged; what moving light took away is a poor keypoint, but one."""
    lost = 0.1 if same_light else 0.35
    return np.where(partner >= 0, 1.0, np.where(seen, lost, 0.5))


def draw_pictures(random, visits, frames):
    """(visit, frame, side) twice: stereo, the same drive, or another visit under another sun."""
    a = (int(random.integers(visits)), int(random.integers(frames)), int(random.random() < 0.2))
    kind = random.random()
    if kind < 0.1:
        return a, (a[0], a[1], 1 - a[2])
    visit = a[0] if kind < 0.45 else int((a[0] + random.integers(1, visits)) % visits)
    return a, (visit, int(random.integers(frames)), int(random.random() < 0.2))


def draw_pair(random, place):
    """One pair as a dict of arrays, or None where the two pictures share too little."""
    a, b = draw_pictures(random, *place.images.shape[:2])
    view_a, view_b = place.views[a[1]][a[2]], place.views[b[1]][b[2]]
    size = place.images.shape[-1]
    centre = random.uniform(40, size - 40, (1, 2))
    centre_b, seen = transfer(view_a, view_b, centre)
    if not seen[0]:
        return None
    into_a = draw_similarity(random, centre[0])
    into_b = draw_similarity(random, centre_b[0] + random.normal(0, 12, 2))
    corners_a, corners_b = place.corners_in(a, into_a), place.corners_in(b, into_b)
    seen_a, partner_a = repeated(view_a, view_b, corners_a, corners_b)
    seen_b, partner_b = repeated(view_b, view_a, corners_b, corners_a)
    candidates = np.concatenate([corners_a[partner_a >= 0], corners_a[seen_a & (partner_a < 0)],
                                 random.uniform(-60, 60, (2 * POINTS, 2)) + centre])
    there, seen = transfer(view_a, view_b, candidates)
    points_a, points_b = into_a(candidates), into_b(there)
    both = np.nonzero(seen & inside(points_a) & inside(points_b))[0][:POINTS]
    if len(both) < POINTS // 2:
        return None
    padding = np.resize(both, POINTS)
    same_light = a[0] == b[0]
    result = {"points_a": points_a[padding], "points_b": points_b[padding],
              "valid": np.arange(POINTS) < len(both)}
    for name, picture, into, found, seen_, partner in (("a", a, into_a, corners_a, seen_a, partner_a),
                                                       ("b", b, into_b, corners_b, seen_b, partner_b)):
        result["image_" + name] = relit(random, into.cut(place.images[picture])).numpy()
        here, weights = into(found), corner_weights(seen_, partner, same_light)
        result["heat_" + name] = heat_target(here, weights)
    return result


def draw_batch(places, seed, step, pairs):
    """Tensors of `pairs` pairs of different places."""
    random = np.random.default_rng([seed, step])
    drawn = []
    for index in random.permutation(len(places)):
        tries = (draw_pair(random, places[index]) for _ in range(8))
        drawn += [pair for pair in [next(filter(None, tries), None)] if pair]
        if len(drawn) == pairs:
            break
    return {key: torch.from_numpy(np.stack([pair[key] for pair in drawn]).astype(
        bool if key == "valid" else np.float32)) for key in drawn[0]}
