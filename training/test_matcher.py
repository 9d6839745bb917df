"""python3 -m unittest discover training: a batch of pairs says of each what it would say of it alone. Needs PyTorch."""
import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
try:
    import torch

    from match_pairs import stacked
    from matcher import WIDTH, Matcher, select
except ImportError:
    torch = None


def features(random, count):
    return [random.standard_normal((count, columns)).astype(np.float32) for columns in (2, WIDTH)]


@unittest.skipUnless(torch, "no PyTorch: scripts/setup --training")
class Batches(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(1)
        self.network = Matcher()
        for parameter in self.network.parameters():  # it begins as nearest neighbours, which look at nothing else
            torch.nn.init.normal_(parameter, std=0.1)
        random = np.random.default_rng(1)
        self.pairs = [(features(random, a), features(random, b)) for a, b in ((7, 12), (20, 5))]

    def test_say_of_a_pair_what_is_said_of_it_alone(self):
        rows = [stacked([pair[side][kind] for pair in self.pairs], 0) for kind in (0, 1) for side in (0, 1)]
        real = [stacked([np.ones(len(pair[side][0]), bool) for pair in self.pairs], False) for side in (0, 1)]
        *_, last = self.network.layers(*rows, *real)
        log, has_a, has_b = self.network.assignment(*last, *real)
        for index, (a, b) in enumerate(self.pairs):
            alone = self.network(*map(torch.from_numpy, (a[0], b[0], a[1], b[1])))
            together = log[index, :len(a[0]), :len(b[0])]
            torch.testing.assert_close(together, alone, atol=1e-4, rtol=1e-4)
            self.assertGreater(float(alone.std()), 0.1)

    def test_choose_each_point_once(self):
        log = torch.tensor([[-0.1, -3.0, -5.0], [-0.5, -0.2, -4.0]])
        matches, scores = select(log)
        self.assertEqual(matches.tolist(), [[0, 0], [1, 1]])
        torch.testing.assert_close(scores, torch.tensor([-0.1, -0.2]).exp())


if __name__ == "__main__":
    unittest.main()
