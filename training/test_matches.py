"""python3 -m unittest discover training: who is whose partner, which the matcher is taught. Needs numpy alone."""
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from matches import NONE, UNKNOWN, judge, partners
from test_views import view_at


class Partners(unittest.TestCase):
    """Two cameras before a wall: b sees what a sees 10 pixels further left."""
    a, b = view_at(0.0, 5.0), view_at(0.5, 5.0)

    def partners(self, pixels_a, pixels_b):
        return [list(each) for each in partners(self.a, self.b, np.array(pixels_a), np.array(pixels_b))]

    def test_are_each_others_nearest_within_three_pixels(self):
        of_a, of_b = self.partners([[40.0, 30.0], [41.0, 30.0]], [[60.0, 50.0], [31.2, 30.0]])
        self.assertEqual(of_a, [UNKNOWN, 1])  # the first one lies near, but another one lies nearer
        self.assertEqual(of_b, [NONE, 1])

    def test_are_none_out_of_the_picture_and_where_nothing_was_found(self):
        of_a, of_b = self.partners([[5.0, 30.0], [50.0, 10.0]], [[10.0, 50.0]])
        self.assertEqual((of_a, of_b), ([NONE, NONE], [NONE]))

    def test_are_not_told_between_three_and_five_pixels(self):
        of_a, of_b = self.partners([[40.0, 30.0]], [[34.0, 30.0]])
        self.assertEqual((of_a, of_b), ([UNKNOWN], [UNKNOWN]))

    def test_are_not_told_where_depth_is_unknown(self):
        sky = view_at(0.0, np.inf)
        of_a, of_b = partners(sky, self.b, np.array([[40.0, 30.0]]), np.array([[70.0, 50.0]]))
        self.assertEqual((of_a[0], of_b[0]), (UNKNOWN, NONE))

    def test_nothing_matches_what_something_nearer_hides(self):
        b = view_at(0.5, 5.0)
        b.depth_m[:, 25:35] = 2.0
        of_a, _ = partners(self.a, b, np.array([[40.0, 30.0]]), np.array([[30.0, 30.0]]))
        self.assertEqual(of_a[0], UNKNOWN)


class Judgement(unittest.TestCase):
    def test_counts_right_and_wrong_and_leaves_out_what_it_cannot_know(self):
        a, b = view_at(0.0, 5.0), view_at(0.5, 5.0)
        a.depth_m[:20] = np.inf
        pixels_a = np.array([[40.0, 30.0], [40.0, 30.0], [40.0, 30.0], [5.0, 30.0], [40.0, 10.0]])
        pixels_b = np.array([[31.0, 30.0], [50.0, 30.0], [34.0, 30.0], [10.0, 30.0], [30.0, 10.0]])
        right, judged = judge(a, b, pixels_a, pixels_b)
        self.assertEqual(list(right), [True, False, False, False, False])
        self.assertEqual(list(judged), [True, True, True, True, False])


if __name__ == "__main__":
    unittest.main()
