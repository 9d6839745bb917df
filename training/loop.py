"""What the trainings share: arguments, schedule, checkpoints and log."""
import argparse
import math
import time
from pathlib import Path

import torch

WARM_UP = 100


def parser(description):
    result = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("--data", type=Path, required=True, help="what generate.py wrote")
    result.add_argument("-o", "--output", type=Path, required=True)
    result.add_argument("--steps", type=int, default=4000)
    result.add_argument("--until", type=int, default=1_000_000, help="stop here, in the schedule of all --steps")
    result.add_argument("--pairs", type=int, default=8, help="per step")
    result.add_argument("--seed", type=int, default=1)
    result.add_argument("--threads", type=int, default=1)
    result.add_argument("--check-every", type=int, default=500, help="steps between looks at the held-back places")
    return result


class Training:
    """Of one network. A subclass says how a step adds to the gradients (`backward`, which returns what the log shows,
    by name) and how well the network does on the held-back places (`check`: a score, and text)."""
    fastest = 1e-3

    def __init__(self, arguments, make_network, places, held_back):
        torch.manual_seed(arguments.seed)
        torch.set_num_threads(arguments.threads)
        self.arguments, self.folder = arguments, arguments.output
        self.folder.mkdir(parents=True, exist_ok=True)
        self.places, self.held_back = places, held_back
        if not places or not held_back:
            raise SystemExit(f"{arguments.data}: no places to train on, or none held back; run training/generate.py")
        self.network = make_network()
        self.optimizer = torch.optim.AdamW(self.network.parameters(), self.fastest, weight_decay=1e-3)
        self.step, self.best = 0, -math.inf
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

    def rate(self):
        part = self.step / self.arguments.steps
        return self.fastest * min(1.0, (self.step + 1) / WARM_UP) * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * part)))

    def advance(self):
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate()
        self.optimizer.zero_grad(set_to_none=True)
        shown = self.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimizer.step()
        self.step += 1
        return shown

    def look(self):
        score, text = self.check()
        self.log(f"step {self.step} held back: {text}")
        if score > self.best:
            self.best = float(score)
            torch.save(self.network.state_dict(), self.folder / "best.pt")
        self.save()

    def run(self):
        a = self.arguments
        self.log(f"seed {a.seed}, {len(self.places)} places, {len(self.held_back)} held back, {a.pairs} pairs a step, "
                 f"{a.threads} thread(s), from step {self.step} to {a.steps}")
        begun, shown, last = time.time(), [], min(a.steps, a.until)
        while self.step < last:
            shown.append(self.advance())
            if self.step % 50 == 0:
                means = {name: sum(float(each[name]) for each in shown) / len(shown) for name in shown[0]}
                text = ", ".join(f"{name} {value:.3f}" for name, value in means.items())
                self.log(f"step {self.step}: {text}, {(time.time() - begun) / len(shown):.2f} s a step")
                begun, shown = time.time(), []
            if self.step % a.check_every == 0 or self.step == last:
                self.look()
                begun = time.time()
