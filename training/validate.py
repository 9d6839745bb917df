"""Matching on held-back places, decoded as the product decodes: precision of mutual nearest neighbours by exact truth."""
import numpy as np
import torch
import torch.nn.functional as F

from network import for_use, sample
from views import transfer

KEYPOINTS = 400
RIGHT_PX = 3.0


def detect(logits, reliability, count=KEYPOINTS):
    """Pixels [N, 2], best first."""
    heat = F.pixel_shuffle(logits.softmax(1)[:, :64], 8)
    height, width = heat.shape[2:]
    peak = (heat == F.max_pool2d(heat, 5, 1, 2)) & (heat > 0.05)
    v, u = torch.nonzero(peak[0, 0], as_tuple=True)
    pixels = torch.stack([u, v], 1).float()
    trust = F.grid_sample(reliability, (2 * pixels / torch.tensor([width - 1.0, height - 1.0]) - 1)[None, :, None],
                          align_corners=False)[0, 0, :, 0]
    order = (heat[0, 0, v, u] * trust).argsort(descending=True, stable=True)[:count]
    return pixels[order]


def features(network, image):
    grey = torch.from_numpy(image.astype(np.float32) / 255)[None, None]
    with torch.no_grad():
        descriptors, logits, reliability = network(grey)
        pixels = detect(logits, reliability)
        rows = sample(F.normalize(descriptors, dim=1), pixels[None], image.shape[1], image.shape[0])[0]
    return pixels.numpy(), F.normalize(rows, dim=1).numpy()


def mutual_nearest(a, b):
    products = a @ b.T
    forward, backward = products.argmax(1), products.argmax(0)
    mutual = backward[forward] == np.arange(len(a))
    return np.nonzero(mutual)[0], forward[mutual]


def score_pair(network, place, a, b):
    """(right matches, matches that can be judged)."""
    (pixels_a, rows_a), (pixels_b, rows_b) = (features(network, place.images[p]) for p in (a, b))
    if len(pixels_a) == 0 or len(pixels_b) == 0:
        return 0, 0
    i, j = mutual_nearest(rows_a, rows_b)
    there, seen = transfer(place.views[a[1]][a[2]], place.views[b[1]][b[2]], pixels_a[i].astype(float))
    near = np.linalg.norm(there - pixels_b[j], axis=1) < RIGHT_PX
    return int((near & seen).sum()), int(seen.sum())


def validate(network, places):
    """Per kind of pair: mean right matches and precision in percent, of 400 keypoints."""
    ready = for_use(network)
    kinds = {"drive": (0, 1, 4), "sun 30": (1, 1, 3), "sun 75": (2, 1, 3), "sun 180": (3, 1, 3)}
    report = {}
    for kind, (visit, frame_a, frame_b) in kinds.items():
        pairs = [score_pair(ready, p, (0, frame_a, 0), (visit, frame_b, 0)) for p in places]
        right, judged = np.sum(pairs, 0)
        report[kind] = (right / len(pairs), 100.0 * right / max(judged, 1))
    return report
