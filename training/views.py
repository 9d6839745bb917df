"""Exact correspondence between pictures of one place, from depth and poses."""
from dataclasses import dataclass

import numpy as np

SKY_M = 1000.0  # depths beyond are sky or as good as it


@dataclass
class View:
    """Where a picture was taken from, and how far away what it shows is."""
    T_map_camera: np.ndarray
    depth_m: np.ndarray  # [row, column]; inf: not known
    focal_px: float
    centre_px: np.ndarray

    def unproject(self, pixels, depth_m):
        rays = np.column_stack([(pixels - self.centre_px) / self.focal_px, np.ones(len(pixels))])
        return (rays * depth_m[:, None]) @ self.T_map_camera[:3, :3].T + self.T_map_camera[:3, 3]

    def project(self, p_map):
        """Pixels and depths."""
        p = (p_map - self.T_map_camera[:3, 3]) @ self.T_map_camera[:3, :3]
        z = np.where(p[:, 2] > 1e-3, p[:, 2], np.inf)
        return p[:, :2] / z[:, None] * self.focal_px + self.centre_px, p[:, 2]


def sample_depth(depth_m, pixels):
    """Interpolated in 1 / depth, which is linear on a plane; inf outside, across an edge and in the sky."""
    height, width = depth_m.shape
    inside = (pixels >= 0).all(1) & (pixels[:, 0] < width - 1) & (pixels[:, 1] < height - 1)
    low = np.where(inside[:, None], pixels, 0.0).astype(int)
    u, v = low.T
    corners = np.stack([depth_m[v, u], depth_m[v, u + 1], depth_m[v + 1, u], depth_m[v + 1, u + 1]])
    fu, fv = (np.where(inside[:, None], pixels, 0.0) - low).T
    weights = np.stack([(1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv])
    smooth = inside & (corners.max(0) < SKY_M) & (corners.max(0) < 1.1 * corners.min(0))
    inverse = (weights / corners).sum(0)
    return np.where(smooth, 1.0 / np.maximum(inverse, 1e-9), np.inf)


def transfer(a, b, pixels):
    """Where b sees what a shows at `pixels`, and whether it sees it at all: in the picture, nothing in front."""
    depth_a = sample_depth(a.depth_m, pixels)
    known = np.isfinite(depth_a)
    pixels_b, z = b.project(a.unproject(pixels, np.where(known, depth_a, 1.0)))
    depth_b = sample_depth(b.depth_m, pixels_b)
    agree = np.abs(np.where(np.isfinite(depth_b), depth_b, 0.0) - z) < 0.02 * z
    return pixels_b, known & (z > 0.1) & agree


def right_view(left, baseline_m):
    """The right camera's view: the left depths carried over, the nearest wins; what no left pixel reaches is unknown."""
    height, width = left.depth_m.shape
    rows, columns = np.mgrid[:height, :width]
    shift = left.focal_px * baseline_m / left.depth_m
    target = np.rint(columns - shift).astype(int)
    hit = (target >= 0) & (left.depth_m < SKY_M)
    depth = np.full((height, width), np.inf)
    np.minimum.at(depth, (rows[hit], target[hit]), left.depth_m[hit])
    pose = left.T_map_camera.copy()
    pose[:3, 3] += pose[:3, 0] * baseline_m
    return View(pose, fill_single_holes(depth), left.focal_px, left.centre_px)


def stereo_views(packed):
    """[frame][side] of a place as generate.py packs it."""
    lefts = [View(pose, depth, float(packed["focal_px"]), packed["centre_px"])
             for pose, depth in zip(packed["T_map_left"], packed["depth_m"])]
    return [(left, right_view(left, float(packed["baseline_m"]))) for left in lefts]


def fill_single_holes(depth):
    """Stretched ground leaves columns of one pixel empty: they take the farther neighbour's depth."""
    filled = depth.copy()
    neighbours = np.maximum(depth[:, :-2], depth[:, 2:])
    hole = ~np.isfinite(depth[:, 1:-1])
    filled[:, 1:-1][hole] = neighbours[hole]
    return filled
