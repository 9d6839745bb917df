"""Matching on held-back places, decoded as the product decodes: mutual nearest neighbours, judged by exact truth."""
import numpy as np
import torch

from decode import decode
from matches import RIGHT_PX
from network import for_use
from views import transfer

KEYPOINTS = 400


def features(network, image):
    grey = torch.from_numpy(image.astype(np.float32) / 255)[None, None]
    with torch.no_grad():
        pixels, rows = decode(*network(grey.to(next(network.parameters()).device)), KEYPOINTS)
    return pixels.cpu().numpy(), rows.cpu().numpy()


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
