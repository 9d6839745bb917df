#!/usr/bin/env python3
"""Runs an extractor, the embedded one or one just trained, on every picture of the rendered places, as it is and relit.

  training/extract.py --data runs/training/data -o runs/training/features

SEED.npz of a place: pixels float32 [copy, visit, frame, side, N, 2], best first, nan where a picture has fewer than N;
descriptors float16 [copy, visit, frame, side, N, 64]. Places that are there already are kept.
"""
import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import nn

from decode import decode
from network import Lunar, for_use
from pairs import relit

EXTRACTOR = Path(__file__).parent.parent / "src/demslam/features/weights/lunar.onnx"
COPIES = 2  # the first one as it is
KEYPOINTS = 1024


def embedded():
    """The network with the embedded weights. The export has folded each BatchNorm into its convolution."""
    graph = onnx.load(EXTRACTOR).graph
    values = {each.name.removesuffix("_half"): torch.from_numpy(numpy_helper.to_array(each).astype(np.float32))
              for each in graph.initializer}
    network = Lunar().eval()
    named = {name: value for name, value in values.items() if name in network.state_dict()}
    network.load_state_dict(named, strict=False)
    blocks = [m for m in network.modules() if isinstance(m, nn.Sequential) and isinstance(m[1], nn.BatchNorm2d)]
    folded = [node.input[1:] for node in graph.node if node.op_type == "Conv" and node.input[1] not in named]
    for (convolution, norm, _), (weight, bias) in zip(blocks, folded, strict=True):
        convolution.weight.data, norm.bias.data, norm.eps = values[weight], values[bias], 0.0
    return network


def trained(run):
    network = Lunar()
    network.load_state_dict(torch.load(run / "best.pt", weights_only=True, map_location="cpu"))
    return for_use(network)


def copies(random, image):
    """[1, 1, rows, columns] each."""
    grey = torch.from_numpy(image.astype(np.float32) / 255)[None, None]
    return [grey] + [relit(random, grey) for _ in range(COPIES - 1)]


@torch.no_grad()
def extract(network, seed, images):
    """images [visit, frame, side, row, column]."""
    random = np.random.default_rng([seed, COPIES])
    shape = (COPIES, *images.shape[:3], KEYPOINTS)
    pixels, descriptors = np.full((*shape, 2), np.nan, np.float32), np.zeros((*shape, 64), np.float16)
    for picture in np.ndindex(images.shape[:3]):
        for copy, grey in enumerate(copies(random, images[picture])):
            found, rows = (each.numpy() for each in decode(*network(grey), KEYPOINTS))
            pixels[copy, *picture, :len(found)], descriptors[copy, *picture, :len(found)] = found, rows
    most = np.isfinite(pixels[..., 0]).sum(-1).max()
    return {"pixels": pixels[..., :most, :], "descriptors": descriptors[..., :most, :]}


def extract_file(network, folder, file):
    torch.set_num_threads(1)
    packed = np.load(file)
    features = extract(network, int(file.stem), np.stack([packed["left"], packed["right"]], 2))
    unfinished = folder / f"{file.stem}.part.npz"
    np.savez(unfinished, **features)
    unfinished.rename(folder / file.name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="what generate.py wrote")
    parser.add_argument("--run", type=Path, help="what train.py wrote: its weights instead of the embedded ones")
    parser.add_argument("--jobs", type=int, default=1, help="places at the same time")
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    network = trained(arguments.run) if arguments.run else embedded()
    missing = [f for f in sorted(arguments.data.glob("*[0-9].npz")) if not (arguments.output / f.name).exists()]
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for count, _ in enumerate(pool.map(partial(extract_file, network, arguments.output), missing), 1):
            print(f"\r{count} of {len(missing)} places", end="", flush=True)
    print(f"\n{arguments.output}: done")


if __name__ == "__main__":
    main()
