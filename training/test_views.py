"""python3 -m unittest discover training: the truth that the training rests on. Needs numpy alone."""
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from places import HELD_BACK, place
from views import View, right_view, sample_depth, transfer


def view_at(x_m, depth_m):
    """A camera looking along +z at a wall, moved sideways."""
    pose = np.eye(4)
    pose[0, 3] = x_m
    return View(pose, np.full((60, 80), depth_m), 100.0, np.array([39.5, 29.5]))


class Transfer(unittest.TestCase):
    def test_moves_a_wall_by_focal_length_times_step_over_depth(self):
        pixels, seen = transfer(view_at(0.0, 5.0), view_at(0.5, 5.0), np.array([[40.0, 30.0], [5.0, 30.0]]))
        np.testing.assert_allclose(pixels[0], [30.0, 30.0], atol=1e-9)
        self.assertEqual(list(seen), [True, False])  # the second one left the picture

    def test_does_not_see_what_something_nearer_hides(self):
        b = view_at(0.5, 5.0)
        b.depth_m[:, 25:35] = 2.0
        _, seen = transfer(view_at(0.0, 5.0), b, np.array([[40.0, 30.0], [60.0, 30.0]]))
        self.assertEqual(list(seen), [False, True])

    def test_forth_and_back_is_where_it_began(self):
        a, b = view_at(0.0, 5.0), view_at(0.3, 5.0)
        pixels = np.array([[40.25, 30.75], [50.5, 10.5]])
        there, _ = transfer(a, b, pixels)
        back, _ = transfer(b, a, there)
        np.testing.assert_allclose(back, pixels, atol=1e-9)


class Depth(unittest.TestCase):
    def test_is_not_known_across_an_edge_nor_outside(self):
        depth = np.full((10, 10), 4.0)
        depth[:, 5:] = 8.0
        known = np.isfinite(sample_depth(depth, np.array([[2.5, 2.5], [4.5, 2.5], [-1.0, 2.0], [9.5, 2.0]])))
        self.assertEqual(list(known), [True, False, False, False])

    def test_of_the_right_camera_is_the_left_ones_shifted_by_the_disparity(self):
        left = view_at(0.0, 5.0)
        left.depth_m[20:40, 50:60] = 2.5
        right = right_view(left, 0.5)
        self.assertEqual(right.depth_m[30, 35], 2.5)  # 55 - 100 * 0.5 / 2.5
        self.assertEqual(right.depth_m[10, 35], 5.0)
        np.testing.assert_allclose(right.T_map_camera[:3, 3], [0.5, 0.0, 0.0])


class Places(unittest.TestCase):
    def test_are_functions_of_their_seed(self):
        self.assertEqual(place(3), place(3))
        self.assertNotEqual(place(3).text, place(4).text)

    def test_visits_differ_in_the_sun_alone(self):
        first, second = (place(HELD_BACK).scene(visit).splitlines() for visit in (0, 3))
        changed = {a.split()[0] for a, b in zip(first, second) if a != b}
        self.assertEqual(changed, {"sun_elevation_deg", "sun_azimuth_deg"})


if __name__ == "__main__":
    unittest.main()
