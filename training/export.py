#!/usr/bin/env python3
"""Writes trained weights as the ONNX graph that the product embeds, with its card.

  training/export.py runs/training/run/best.pt -o src/demslam/features/weights/lunar.onnx
"""
import argparse
import hashlib
import io
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import helper, numpy_helper

from network import Lunar, for_use


class ThreeChannels(torch.nn.Module):
    """The contract feeds three equal channels."""

    def __init__(self, network):
        super().__init__()
        self.network = network

    def forward(self, image):
        return self.network(image)


def graph_of(network):
    buffer, sides = io.BytesIO(), {2: "height", 3: "width"}
    cells = {2: "rows", 3: "columns"}
    torch.onnx.export(ThreeChannels(network).eval(), torch.rand(1, 3, 64, 96), buffer, opset_version=17, dynamo=False,
                      input_names=["image"], output_names=["descriptors", "keypoint_logits", "reliability"],
                      dynamic_axes={"image": {0: "batch", **sides}, "descriptors": {0: "batch", **cells},
                                    "keypoint_logits": {0: "batch", **cells}, "reliability": {0: "batch", **cells}})
    return onnx.load_from_string(buffer.getvalue())


def halve(model):
    """Weights of 1024 numbers and more as float16, widened when the graph is loaded: half the file, same arithmetic."""
    graph = model.graph
    for index, weight in enumerate(list(graph.initializer)):
        values = numpy_helper.to_array(weight)
        if values.dtype != np.float32 or values.size < 1024:
            continue
        name, half = weight.name, weight.name + "_half"
        graph.initializer.remove(weight)
        graph.initializer.append(numpy_helper.from_array(values.astype(np.float16), half))
        graph.node.insert(0, helper.make_node("Cast", [half], [name], name=f"widen_{index}", to=onnx.TensorProto.FLOAT))
    onnx.checker.check_model(model)
    return model


CARD = """name = "demslam lunar"
contract = "xfeat"
licence = "Apache-2.0, as demslam: trained by training/ on images of demslam's own simulator alone"
sha256 = "{sha256}"
normalisation = "unit"
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    network = Lunar()
    network.load_state_dict(torch.load(arguments.weights, weights_only=True))
    model = halve(graph_of(for_use(network)))
    for field in ("doc_string", "producer_version"):
        model.ClearField(field)
    for node in model.graph.node:
        node.ClearField("doc_string")
    content = model.SerializeToString(deterministic=True)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_bytes(content)
    digest = hashlib.sha256(content).hexdigest()
    Path(f"{arguments.output}.toml").write_text(CARD.format(sha256=digest))
    print(f"{arguments.output}: {len(content)} bytes, sha256 {digest}")


if __name__ == "__main__":
    main()
