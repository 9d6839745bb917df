#!/usr/bin/env python3
"""Trains the front-end's network on rendered places (generate.py).

  training/train.py --data runs/training/data -o runs/training/run --steps 4000

Writes log.txt, checkpoint.pt (resumed by the same command) and best.pt, the weights that did best on the held-back
places. Same data, steps, seed and number of threads: same weights, interrupted or not.
"""
import argparse
import math
import time
from pathlib import Path

import torch
import torch.nn.functional as F

from network import Lunar, sample
from pairs import CROP, Place, draw_batch
from places import HELD_BACK
from validate import validate

SHARPNESS = 16.0  # of the softmax over cosines
NEAR_PX = 6.0  # points this close to the right one are not called wrong
FASTEST = 2e-3
WARM_UP = 100


def dual_softmax(rows_a, rows_b, points_b, valid):
    """Loss over every other point of the whole batch, and which points already find their partner."""
    pairs, points = valid.shape
    a, b = rows_a.flatten(0, 1), rows_b.flatten(0, 1)
    logits = SHARPNESS * a @ b.T
    near = torch.block_diag(*(torch.cdist(points_b, points_b) < NEAR_PX))
    near.fill_diagonal_(False)
    logits = logits.masked_fill(near | ~valid.flatten()[None], -1e4)
    each = torch.arange(len(a))
    keep = valid.flatten()
    loss = F.cross_entropy(logits[keep], each[keep]) + F.cross_entropy(logits.T[keep], each[keep])
    found = (logits.argmax(1) == each) & (logits.argmax(0) == each)
    return loss / 2, found.view(pairs, points)


def keypoint_loss(logits, target):
    return -(target * logits.log_softmax(1)).sum(1).mean()


def step_losses(network, batch):
    images = torch.cat([batch["image_a"], batch["image_b"]])
    with torch.autocast("cpu", torch.bfloat16):  # half the time; the weights and the losses stay in fp32
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
    return match + keypoints + 0.5 * reliable, (match, keypoints, reliable, right)


def rate(step, steps):
    return FASTEST * min(1.0, (step + 1) / WARM_UP) * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * step / steps)))


class Training:
    def __init__(self, arguments):
        torch.manual_seed(arguments.seed)
        torch.set_num_threads(arguments.threads)
        self.arguments, self.folder = arguments, arguments.output
        self.folder.mkdir(parents=True, exist_ok=True)
        files = sorted(arguments.data.glob("*.npz"), key=lambda f: int(f.stem))
        self.places = [Place(f) for f in files if int(f.stem) < HELD_BACK]
        self.held_back = [Place(f) for f in files if int(f.stem) >= HELD_BACK]
        if not self.places or not self.held_back:
            raise SystemExit(f"{arguments.data}: no places to train on, or none held back; run training/generate.py")
        self.network = Lunar()
        self.optimizer = torch.optim.AdamW(self.network.parameters(), FASTEST, weight_decay=1e-3)
        self.step, self.best = 0, -1.0
        self.resume()

    def resume(self):
        file = self.folder / "checkpoint.pt"
        if file.exists():
            saved = torch.load(file, weights_only=True)
            self.network.load_state_dict(saved["network"])
            self.optimizer.load_state_dict(saved["optimizer"])
            self.step, self.best = saved["step"], saved["best"]

    def save(self):
        unfinished = self.folder / "checkpoint.part"
        torch.save({"network": self.network.state_dict(), "optimizer": self.optimizer.state_dict(),
                    "step": self.step, "best": self.best}, unfinished)
        unfinished.rename(self.folder / "checkpoint.pt")

    def log(self, text):
        print(text, flush=True)
        with open(self.folder / "log.txt", "a") as stream:
            stream.write(text + "\n")

    def batch(self):
        batch = draw_batch(self.places, self.arguments.seed, self.step, self.arguments.pairs)
        shape = (2 * len(batch["points_a"]),) + batch["points_a"].shape[1:]
        generator = torch.Generator().manual_seed(self.arguments.seed * 1_000_003 + self.step)
        return {**batch, "jitter": torch.randn(shape, generator=generator) * 0.7}

    def advance(self):
        for group in self.optimizer.param_groups:
            group["lr"] = rate(self.step, self.arguments.steps)
        loss, parts = step_losses(self.network, self.batch())
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimizer.step()
        self.step += 1
        return torch.stack(parts).detach()

    def check(self):
        report = validate(self.network, self.held_back)
        score = float(sum(right for right, _ in report.values()))
        text = "; ".join(f"{kind}: {right:.0f} right, {precision:.0f} %" for kind, (right, precision) in report.items())
        self.log(f"step {self.step} held back: {text}")
        if score > self.best:
            self.best = score
            torch.save(self.network.state_dict(), self.folder / "best.pt")
        self.save()

    def run(self):
        a = self.arguments
        self.log(f"seed {a.seed}, {len(self.places)} places, {len(self.held_back)} held back, {a.pairs} pairs a step, "
                 f"{a.threads} thread(s), from step {self.step} to {a.steps}")
        begun, parts = time.time(), []
        while self.step < min(a.steps, a.until):
            parts.append(self.advance())
            if self.step % 50 == 0:
                match, keypoints, reliable, right = torch.stack(parts).mean(0).tolist()
                self.log(f"step {self.step}: match {match:.3f}, keypoints {keypoints:.3f}, reliability {reliable:.3f}, "
                         f"{100 * right:.1f} % found, {(time.time() - begun) / len(parts):.2f} s a step")
                begun, parts = time.time(), []
            if self.step % a.check_every == 0 or self.step == a.steps:
                self.check()
                begun = time.time()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--until", type=int, default=1_000_000, help="stop here, in the schedule of all --steps")
    parser.add_argument("--pairs", type=int, default=8, help="per step")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--check-every", type=int, default=500, help="steps between looks at the held-back places")
    Training(parser.parse_args()).run()


if __name__ == "__main__":
    main()
