"""Which keypoints of two pictures of one place show the same point of the ground, from depth and poses."""
import numpy as np

from views import sample_depth, transfer

RIGHT_PX = 3.0
FAR_PX = 5.0
NONE, UNKNOWN = -1, -2


def distances(a, b):
    return np.linalg.norm(a[:, None] - b, axis=2)


def partners(a, b, pixels_a, pixels_b):
    """Per keypoint of view a, and per keypoint of b: the index of its partner in the other view, NONE where it surely
    has none, UNKNOWN where that cannot be said."""
    there, seen_a = transfer(a, b, pixels_a)
    back, seen_b = transfer(b, a, pixels_b)
    to_b, to_a = distances(there, pixels_b), distances(back, pixels_a)
    nearest = to_b.argmin(1)
    each = np.arange(len(pixels_a))
    matched = (to_a.argmin(1)[nearest] == each) & seen_a & seen_b[nearest]
    matched &= (to_b[each, nearest] < RIGHT_PX) & (to_a[nearest, each] < RIGHT_PX)
    partner_a, partner_b = none_or_unknown(a, pixels_a, to_b), none_or_unknown(b, pixels_b, to_a)
    partner_a[matched] = nearest[matched]
    partner_b[nearest[matched]] = each[matched]
    return partner_a, partner_b


def none_or_unknown(view, pixels, to_other):
    """A point whose place in the other view is known, with no keypoint of the other near it, has no partner."""
    known = np.isfinite(sample_depth(view.depth_m, pixels))
    return np.where(known & (to_other.min(1) > FAR_PX), NONE, UNKNOWN)


def judge(a, b, pixels_a, pixels_b):
    """Of proposed matches, row by row: which are right, and which can be judged at all."""
    there, seen = transfer(a, b, pixels_a)
    away = np.linalg.norm(there - pixels_b, axis=1)
    known = np.isfinite(sample_depth(a.depth_m, pixels_a))
    return seen & (away < RIGHT_PX), seen | (known & (away > FAR_PX))
