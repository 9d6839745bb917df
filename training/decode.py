"""From the network's maps to keypoints and descriptors, as the product does it (src/demslam/features/xfeat.cpp)."""
import math

import torch
import torch.nn.functional as F

from network import CELL, sample

MIN_PROBABILITY = 0.05


def decode(descriptors, logits, reliability, count):
    """The maps of one picture -> pixels [N, 2] and unit descriptors [N, width], best first."""
    heat = F.pixel_shuffle(logits.softmax(1)[:, :CELL * CELL], CELL)
    height, width = heat.shape[2:]
    peak = (heat == F.max_pool2d(heat, 5, 1, 2)) & (heat > MIN_PROBABILITY)
    v, u = torch.nonzero(peak[0, 0], as_tuple=True)
    whole = torch.stack([u, v], 1).float()
    size = torch.tensor([width - 1.0, height - 1.0], device=whole.device)
    trust = F.grid_sample(reliability, (2 * whole / size - 1)[None, :, None], align_corners=False)[0, 0, :, 0]
    order = (heat[0, 0, v, u] * trust).argsort(descending=True, stable=True)[:count]
    rows = sample(F.normalize(descriptors, dim=1), whole[order][None], width, height)[0]
    return sub_pixel(heat[0, 0], u[order], v[order]), F.normalize(rows, dim=1)


def sub_pixel(heat, u, v):
    """To the top of the parabola through three log-probabilities, along each axis; not at the picture's edge."""
    log = F.pad(heat.clamp(min=1e-9).log(), (1, 1, 1, 1), value=math.nan)

    def offset(du, dv):
        before, here, after = (log[v + 1 + step * dv, u + 1 + step * du] for step in (-1, 0, 1))
        curvature = before - 2 * here + after
        return torch.where(curvature < 0, (0.5 * (before - after) / curvature).clamp(-0.5, 0.5), 0.0)
    return torch.stack([u + offset(1, 0), v + offset(0, 1)], 1)
