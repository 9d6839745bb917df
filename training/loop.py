"""What the trainings share: arguments, schedule, batches, checkpoints and log."""
import argparse
import math
import time
from pathlib import Path

import torch
from torch.utils.data import DataLoader, Dataset

WARM_UP = 100


def parser(description):
    result = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    result.add_argument("--data", type=Path, required=True, help="what generate.py wrote")
    result.add_argument("-o", "--output", type=Path, required=True)
    result.add_argument("--steps", type=int, default=4000)
    result.add_argument("--until", type=int, default=1_000_000, help="stop here, in the schedule of all --steps")
    result.add_argument("--pairs", type=int, default=8, help="per step")
    result.add_argument("--seed", type=int, default=1)
    result.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu", help="%(default)s here")
    result.add_argument("--threads", type=int, default=1, help="of PyTorch, where the device is the processor")
    result.add_argument("--workers", type=int, default=0, help="processes that draw batches ahead (0: none)")
    result.add_argument("--check-every", type=int, default=500, help="steps between looks at the held-back places")
    return result


class Steps(Dataset):
    """The batch of each step to come."""
    def __init__(self, draw, first, last):
        self.draw, self.steps = draw, range(first, last)

    def __len__(self):
        return len(self.steps)

    def __getitem__(self, index):
        return self.draw(self.steps[index])


class Training:
    """Of one network. A subclass says what a step is made of (`draw`, a pure function of the step), what that adds to
    the gradients (`backward`, which returns what the log shows, by name) and how well the network does on the
    held-back places (`check`: a score, and text)."""
    fastest = 1e-3

    def __init__(self, arguments, make_network, places, held_back):
        torch.manual_seed(arguments.seed)
        torch.set_num_threads(arguments.threads)
        if arguments.device.startswith("cuda"):
            torch.set_float32_matmul_precision("high")
        self.arguments, self.folder, self.device = arguments, arguments.output, torch.device(arguments.device)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.places, self.held_back = places, held_back
        if not places or not held_back:
            raise SystemExit(f"{arguments.data}: no places to train on, or none held back; run training/generate.py")
        self.network = make_network().to(self.device)
        self.optimizer = torch.optim.AdamW(self.network.parameters(), self.fastest, weight_decay=1e-3)
        self.step, self.best = 0, -math.inf
        self.resume()

    def resume(self):
        file = self.folder / "checkpoint.pt"
        if file.exists():
            saved = torch.load(file, weights_only=True, map_location=self.device)
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

    def batches(self, last):
        """Of the steps up to `last`, in their order, whoever draws them."""
        loader = DataLoader(Steps(self.draw, self.step, last), batch_size=None, num_workers=self.arguments.workers)
        return ({name: rows.to(self.device) for name, rows in batch.items()} for batch in loader)

    def advance(self, batch):
        for group in self.optimizer.param_groups:
            group["lr"] = self.rate()
        self.optimizer.zero_grad(set_to_none=True)
        shown = self.backward(batch)
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimizer.step()
        self.step += 1
        return {name: value.detach() for name, value in shown.items()}

    def look(self):
        score, text = self.check()
        self.log(f"step {self.step} held back: {text}")
        if score > self.best:
            self.best = float(score)
            torch.save(self.network.state_dict(), self.folder / "best.pt")
        self.save()

    def run(self):
        a = self.arguments
        begun, shown, last = time.time(), [], min(a.steps, a.until)
        self.log(f"seed {a.seed}, {len(self.places)} places, {len(self.held_back)} held back, {a.pairs} pairs a step, "
                 f"{a.device}, {a.threads} thread(s), from step {self.step} to {last} in a schedule of {a.steps}")
        for batch in self.batches(last):
            shown.append(self.advance(batch))
            if self.step % 50 == 0:
                means = {name: sum(float(each[name]) for each in shown) / len(shown) for name in shown[0]}
                text = ", ".join(f"{name} {value:.3f}" for name, value in means.items())
                self.log(f"step {self.step}: {text}, {(time.time() - begun) / len(shown):.2f} s a step")
                begun, shown = time.time(), []
            if self.step % a.check_every == 0 or self.step == last:
                self.look()
                begun = time.time()
