#!/usr/bin/env python3
"""Writes trained weights as the ONNX graph that the product embeds, with its cards.

  training/export.py runs/training/run -o src/demslam/features/weights/lunar.onnx

Beside it: lunar.onnx.toml, the card that the product reads with a file of its own, and lunar.onnx.md, the model card.
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


def graph_of(network):
    network = for_use(network)
    buffer, sides = io.BytesIO(), {2: "height", 3: "width"}
    cells = {2: "rows", 3: "columns"}
    torch.onnx.export(network, torch.rand(1, 3, 64, 96), buffer, opset_version=17, dynamo=False,
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
min_probability = 0.01
"""

MODEL_CARD = """# demslam lunar

Feature extractor, {weights} weights, {bytes} bytes, SHA-256 `{sha256}`. Licence: Apache-2.0, as demslam.

* Made by `training/` (see its README.md) from images of demslam's own simulator alone; no published weights, no real image.
* For ground without air, seen from a rover with upright cameras, under any sun. It was trained with turns about the axis of 7 degrees and
  changes of scale of 15 % (standard deviations), on top of what the drives themselves show.
* How it does next to others, on held-back places and on real images: `demslam experiment frontend`, docs/models.md.

Training, as its log has it:

{training}

On the held-back places (mean right matches within 3 px and their share, mutual nearest neighbours of 400 keypoints, of all visits):

{held_back}
"""


def stripped(model):
    """Without what differs from one machine to the next."""
    model.ClearField("doc_string")
    model.ClearField("producer_version")
    for node in model.graph.node:
        node.ClearField("doc_string")
    return model


def model_card(template, log, network, content, digest):
    lines = log.read_text().splitlines()
    return template.format(
        weights=sum(p.numel() for p in network.parameters()), bytes=len(content), sha256=digest,
        training="\n".join("    " + line for line in lines if line.startswith("seed ")),
        held_back="\n".join("    " + line for line in lines if " held back: " in line))


def export(description, make_network, graph_of, card, card_in_words):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="the folder that the training wrote")
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    network = make_network()
    network.load_state_dict(torch.load(arguments.run / "best.pt", weights_only=True, map_location="cpu"))
    content = stripped(halve(graph_of(network))).SerializeToString(deterministic=True)
    digest = hashlib.sha256(content).hexdigest()
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    arguments.output.write_bytes(content)
    Path(f"{arguments.output}.toml").write_text(card.format(sha256=digest))
    Path(f"{arguments.output}.md").write_text(
        model_card(card_in_words, arguments.run / "log.txt", network, content, digest))
    print(f"{arguments.output}: {len(content)} bytes, sha256 {digest}")


if __name__ == "__main__":
    export(__doc__, Lunar, graph_of, CARD, MODEL_CARD)
