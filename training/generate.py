#!/usr/bin/env python3
"""Renders training places with the simulator and packs each into one file.

  training/generate.py --demslam build/release/demslam --places 40 -o runs/training/data

SEED.npz of a place: left, right uint8 [visit, frame, row, column]; depth_m float32 [frame, row, column] of the left
camera; corners float32 [visit, frame, side, N, 2]: the detector's teacher; T_map_left float64 [frame, 4, 4]; focal_px,
centre_px, baseline_m; suns_deg [visit, 2]. Places that are there already are kept, so the command goes on where it
stopped.
"""
import argparse
import subprocess
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from corners import packed_corners
from places import HELD_BACK, place


def read_pfm(file):
    with open(file, "rb") as stream:
        kind, size, scale = stream.readline().strip(), stream.readline().split(), float(stream.readline())
        if kind != b"Pf" or scale >= 0.0:
            raise SystemExit(f"{file}: not a little-endian one-channel PFM")
        width, height = map(int, size)
        return np.frombuffer(stream.read(), "<f4").reshape(height, width)[::-1]


def rotation(w, x, y, z):
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def read_poses(file):
    """T_map_body of each frame."""
    rows = np.loadtxt(file, delimiter=",", ndmin=2)
    poses = np.tile(np.eye(4), (len(rows), 1, 1))
    for pose, row in zip(poses, rows):
        pose[:3, 3], pose[:3, :3] = row[1:4], rotation(*row[4:8])
    return poses


def read_images(folder):
    return np.stack([np.asarray(Image.open(f).convert("L")) for f in sorted(folder.glob("*.png"), key=stamp)])


def stamp(file):
    return int(file.stem)


def read_visit(data):
    calibration = tomllib.loads((data / "calibration.toml").read_text())
    left = calibration["left"]
    depths = sorted((data / "image0/depth").glob("*.pfm"), key=stamp)
    return {
        "left": read_images(data / "image0/color"), "right": read_images(data / "image1/color"),
        "depth_m": np.stack([read_pfm(f) for f in depths]),
        "T_map_left": read_poses(data / "gt.txt") @ np.reshape(calibration["body"]["T_body_left"], (4, 4)),
        "focal_px": left["fx"], "centre_px": np.array([left["cx"], left["cy"]]),
        "baseline_m": calibration["T_left_right"][3],
    }


def render(demslam, one, visit, folder):
    scene, data = folder / f"{visit}.toml", folder / str(visit)
    scene.write_text(one.scene(visit))
    done = subprocess.run([demslam, "simulate", scene, "-o", data], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{scene}: {done.stderr.strip()}")
    return read_visit(data)


def generate(demslam, one, file):
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        visits = [render(demslam, one, v, Path(folder)) for v in range(len(one.suns_deg))]
    packed = {**visits[0], "suns_deg": np.array(one.suns_deg)}
    for side in ("left", "right"):
        packed[side] = np.stack([v[side] for v in visits])
    packed["corners"] = packed_corners(np.stack([packed["left"], packed["right"]], 2))
    unfinished = file.with_suffix(".part.npz")
    np.savez(unfinished, **packed)
    unfinished.rename(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--demslam", default="build/release/demslam", help="the program")
    parser.add_argument("--places", type=int, default=40, help="to train on")
    parser.add_argument("--held-back", type=int, default=4, help="to validate on")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--size", type=int, default=320, help="of the pictures, in pixels: a multiple of 32")
    parser.add_argument("--jobs", type=int, default=1, help="places at the same time")
    parser.add_argument("-o", "--output", type=Path, required=True)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    arguments.output.mkdir(parents=True, exist_ok=True)
    held_back = [HELD_BACK + i for i in range(arguments.held_back)]
    wanted = held_back + [arguments.first_seed + i for i in range(arguments.places)]
    missing = [s for s in wanted if not (arguments.output / f"{s}.npz").exists()]
    with ThreadPoolExecutor(arguments.jobs) as pool:
        work = lambda s: generate(arguments.demslam, place(s, size=arguments.size), arguments.output / f"{s}.npz")
        for count, _ in enumerate(pool.map(work, missing), 1):
            print(f"\r{count} of {len(missing)} places", end="", flush=True)
    print(f"\n{arguments.output}: {len(wanted)} places")


if __name__ == "__main__":
    main()
