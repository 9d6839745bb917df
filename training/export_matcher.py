#!/usr/bin/env python3
"""Writes a trained matcher as an ONNX graph of contract "lightglue", with its cards, as export.py does.

  training/export_matcher.py runs/training/matcher -o src/demslam/features/weights/lunar_matcher.onnx
"""
import io

import onnx
import torch
from torch import nn

from export import export
from matcher import WIDTH, Matcher, select


class Graph(nn.Module):
    """Features of two pictures in; matches, each point at most once, and their probabilities out."""
    def __init__(self, matcher):
        super().__init__()
        self.matcher = matcher

    def forward(self, *features):
        return select(self.matcher(*(each[0] for each in features)))


def graph_of(network):
    buffer = io.BytesIO()
    example = (torch.rand(1, 20, 2), torch.rand(1, 30, 2), torch.rand(1, 20, WIDTH), torch.rand(1, 30, WIDTH))
    names = ["kpts0", "kpts1", "desc0", "desc1"]
    torch.onnx.export(Graph(network).eval(), example, buffer, opset_version=17, dynamo=False, input_names=names,
                      output_names=["matches0", "mscores0"],
                      dynamic_axes={**{name: {1: "N" + name[-1]} for name in names},
                                    "matches0": {0: "M"}, "mscores0": {0: "M"}})
    return onnx.load_from_string(buffer.getvalue())


CARD = """name = "demslam lunar matcher"
contract = "lightglue"
licence = "Apache-2.0, as demslam: trained by training/ on images of demslam's own simulator alone"
sha256 = "{sha256}"
normalisation = "centred"
"""

MODEL_CARD = """# demslam lunar matcher

Matcher for the extractor `lunar`, LightGlue's design, {weights} weights, {bytes} bytes, SHA-256 `{sha256}`. Licence: Apache-2.0, as demslam.

* Made by `training/` (see its README.md) on what `lunar` finds in images of demslam's own simulator; no published weights, no real image.
* For the keypoints of `lunar` alone, 64 numbers each; of stereo pairs, drives and revisits under another sun, with cameras as upright as a rover's.
* Each point is matched at most once. The score of a match is its probability; what lies below 0.1 is better left out.

Training, as its log has it:

{training}

On the held-back places (mean right matches within 3 px and precision, score above 0.1, at most 512 keypoints):

{held_back}
"""


if __name__ == "__main__":
    export(__doc__, Matcher, graph_of, CARD, MODEL_CARD)
