"""The detector's teacher: classical corners (Foerstner's measure), found again in another view of the same place."""
import numpy as np
import torch
import torch.nn.functional as F

RADIUS = 3  # one corner per 7x7 pixels
SPREAD_PX = 33  # responses are compared with their surroundings', so that shadows get corners too


def smooth(maps, sigma):
    reach = int(3 * sigma + 0.5)
    x = torch.arange(-reach, reach + 1, dtype=torch.float32)
    kernel = torch.exp(-0.5 * (x / sigma) ** 2)
    kernel = (kernel / kernel.sum()).expand(maps.shape[1], 1, -1)
    padded = F.pad(maps, (reach,) * 4, mode="replicate")
    rows = F.conv2d(padded, kernel[:, :, None], groups=maps.shape[1])
    return F.conv2d(rows, kernel[:, :, :, None], groups=maps.shape[1])


def response(image):
    """det / trace of the structure tensor, relative to the surroundings; [1, 1, rows, columns]."""
    grey = smooth(torch.from_numpy(image.astype(np.float32))[None, None], 1.0)
    du = F.pad(grey[..., 2:] - grey[..., :-2], (1, 1)) / 2
    dv = F.pad(grey[..., 2:, :] - grey[..., :-2, :], (0, 0, 1, 1)) / 2
    uu, vv, uv = smooth(torch.cat([du * du, dv * dv, du * dv], 1), 1.5).split(1, 1)
    strength = (uu * vv - uv * uv) / (uu + vv + 1.0)
    around = F.avg_pool2d(strength, (SPREAD_PX, 1), 1, (SPREAD_PX // 2, 0), count_include_pad=False)
    around = F.avg_pool2d(around, (1, SPREAD_PX), 1, (0, SPREAD_PX // 2), count_include_pad=False)
    return strength / (around + 0.15)


def corners(image, count=700, border=8):
    """Sub-pixel (u, v), strongest first."""
    map_ = response(image)
    peak = (map_ == F.max_pool2d(map_, 2 * RADIUS + 1, 1, RADIUS)) & (map_ > 0.5)
    map_, peak = map_[0, 0].numpy(), peak[0, 0].numpy()
    v, u = np.nonzero(peak[border:-border, border:-border])
    v, u = v + border, u + border
    order = np.argsort(-map_[v, u], kind="stable")[:count]
    v, u = v[order], u[order]
    du = top_of_parabola(map_[v, u - 1], map_[v, u], map_[v, u + 1])
    dv = top_of_parabola(map_[v - 1, u], map_[v, u], map_[v + 1, u])
    return np.column_stack([u + du, v + dv])


def packed_corners(images):
    """Of every image of [..., rows, columns], filled up with nan to as many as the richest has."""
    each = [corners(image) for image in images.reshape(-1, *images.shape[-2:])]
    packed = np.full((len(each), max(map(len, each)), 2), np.nan, np.float32)
    for row, found in zip(packed, each):
        row[:len(found)] = found
    return packed.reshape(*images.shape[:-2], -1, 2)


def top_of_parabola(before, at, after):
    curvature = before - 2 * at + after
    return np.clip(0.5 * (before - after) / np.where(curvature < 0, curvature, -np.inf), -0.5, 0.5)
