#!/usr/bin/env python3
"""Trains the front-end's network on rendered places (generate.py).

  training/train.py --data runs/training/data -o runs/training/run --steps 4000

Writes log.txt, checkpoint.pt (resumed by the same command) and best.pt, the weights that did best on the held-back
places. Same data, steps, seed and number of threads: same weights on a processor, interrupted or not, whoever draws the
batches; on a GPU the same batches, and weights that differ by rounding.
"""
import torch
import torch.nn.functional as F

from loop import Training, parser
from network import Lunar, sample
from pairs import CROP, Place, draw_batch
from places import HELD_BACK
from validate import validate

SHARPNESS = 16.0  # of the softmax over cosines
NEAR_PX = 6.0  # points this close to the right one are not called wrong


def dual_softmax(rows_a, rows_b, points_b, valid):
    """Loss over every other point of the whole batch, and which points already find their partner."""
    pairs, points = valid.shape
    a, b = rows_a.flatten(0, 1), rows_b.flatten(0, 1)
    logits = SHARPNESS * a @ b.T
    near = torch.block_diag(*(torch.cdist(points_b, points_b) < NEAR_PX))
    near.fill_diagonal_(False)
    logits = logits.masked_fill(near | ~valid.flatten()[None], -1e4)
    each = torch.arange(len(a), device=a.device)
    keep = valid.flatten()
    loss = F.cross_entropy(logits[keep], each[keep]) + F.cross_entropy(logits.T[keep], each[keep])
    found = (logits.argmax(1) == each) & (logits.argmax(0) == each)
    return loss / 2, found.view(pairs, points)


def keypoint_loss(logits, target):
    return -(target * logits.log_softmax(1)).sum(1).mean()


def step_losses(network, batch):
    images = torch.cat([batch["image_a"], batch["image_b"]])
    with torch.autocast(images.device.type, torch.bfloat16):  # half the time; the weights and the losses stay in fp32
        descriptors, logits, reliability = (maps.float() for maps in network(images))
    points = torch.cat([batch["points_a"], batch["points_b"]])
    # keypoints are found a pixel off: the descriptors must bear that
    rows = F.normalize(sample(F.normalize(descriptors, dim=1), points + batch["jitter"], CROP, CROP), dim=2)
    rows_a, rows_b = rows.chunk(2)
    match, found = dual_softmax(rows_a, rows_b, batch["points_b"], batch["valid"])
    trust = sample(reliability, points, CROP, CROP)[..., 0].clamp(1e-4, 1 - 1e-4)
    both = torch.cat([batch["valid"], batch["valid"]])
    reliable = F.binary_cross_entropy(trust[both], torch.cat([found, found])[both].float())
    keypoints = keypoint_loss(logits, torch.cat([batch["heat_a"], batch["heat_b"]]))
    right = found[batch["valid"]].float().mean()
    shown = {"match": match, "keypoints": keypoints, "reliability": reliable, "found": right}
    return match + keypoints + 0.5 * reliable, shown


class LunarTraining(Training):
    fastest = 2e-3

    def __init__(self, arguments):
        files = sorted(arguments.data.glob("*[0-9].npz"), key=lambda f: int(f.stem))
        super().__init__(arguments, Lunar, [Place(f) for f in files if int(f.stem) < HELD_BACK],
                         [Place(f) for f in files if int(f.stem) >= HELD_BACK])

    def draw(self, step):
        batch = draw_batch(self.places, self.arguments.seed, step, self.arguments.pairs)
        shape = (2 * len(batch["points_a"]),) + batch["points_a"].shape[1:]
        generator = torch.Generator().manual_seed(self.arguments.seed * 1_000_003 + step)
        return {**batch, "jitter": torch.randn(shape, generator=generator) * 0.7}

    def backward(self, batch):
        loss, shown = step_losses(self.network, batch)
        loss.backward()
        return shown

    def check(self):
        report = validate(self.network, self.held_back)
        text = "; ".join(f"{kind}: {right:.0f} right, {precision:.0f} %" for kind, (right, precision) in report.items())
        return sum(right for right, _ in report.values()), text


if __name__ == "__main__":
    LunarTraining(parser(__doc__).parse_args()).run()
