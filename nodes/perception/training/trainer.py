"""One loop for both models: seeded, resumable, with a progress bar, a log and snapshots for the learning curve."""

import argparse
import csv
import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import torch
from tqdm import tqdm

from .data import PairSet

CLIP_NORM = 2.0
WARM_UP_STEPS = 60
LAST_RATE = 0.02
LOG_EVERY_STEPS = 25


@dataclass
class Plan:
    """What to train and for how long."""

    name: str
    model: torch.nn.Module
    # (model, batch, autocast) to the loss and its parts for the log.
    loss: Callable
    # The batches of all steps from a first one on.
    batches: Callable[[int], Iterator]
    rate: float
    options: argparse.Namespace
    # Goes into every checkpoint: what is needed to rebuild the model and to say how it was made.
    facts: dict = field(default_factory=dict)


def add_options(parser: argparse.ArgumentParser, steps: int, batch: int) -> None:
    """Options that both trainings share."""
    parser.add_argument("--data", action="append", required=True, help="exported pair set, FOLDER or FOLDER:SHARE; repeatable")
    parser.add_argument("--run", type=Path, required=True, help="folder of checkpoints, log and snapshots")
    parser.add_argument("--steps", type=int, default=steps)
    parser.add_argument("--batch", type=int, default=batch, help="pairs a step")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rate", type=float, default=2e-3, help="learning rate")
    parser.add_argument("--device", default="auto", help="auto, cpu or cuda")
    parser.add_argument("--precision", default="auto", choices=("auto", "bf16", "fp32"))
    parser.add_argument("--threads", type=int, default=0, help="CPU threads of the network (0: all)")
    parser.add_argument("--checkpoint-minutes", type=float, default=3)
    parser.add_argument("--snapshot-minutes", type=float, default=5, help="weights kept for the learning curve")
    parser.add_argument("--resume", action=argparse.BooleanOptionalAction, default=True, help="go on where --run stopped")


def pair_sets(options: argparse.Namespace) -> tuple[list[tuple[PairSet, float]], dict]:
    """The pair sets named by --data with their shares, and a description of them."""
    sets = [(PairSet([Path(folder)]), share) for folder, share in folders(options.data)]
    described = {folder.name: s.describe() | {"share": share} for (folder, share), (s, _) in zip(folders(options.data), sets)}
    return sets, described


def folders(texts: list[str]) -> list[tuple[Path, float]]:
    """Folders and shares from FOLDER or FOLDER:SHARE."""
    parts = [text.partition(":") for text in texts]
    return [(Path(folder), float(share or 1)) for folder, _, share in parts]


def device_from(name: str) -> torch.device:
    """`auto` takes the GPU if there is one."""
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    return torch.device(name)


def autocast_from(device: torch.device, precision: str) -> Callable:
    """A maker of contexts: bfloat16 where it is asked for or, by default, where the hardware computes it."""
    if precision == "auto":
        capable = device.type == "cuda" or torch.ops.mkldnn._is_mkldnn_bf16_supported()
        precision = "bf16" if capable else "fp32"
    if precision == "fp32":
        return nullcontext
    return lambda: torch.autocast(device.type, torch.bfloat16)


def rate_at(step: int, steps: int, rate: float) -> float:
    """Learning rate: warm-up, then half a cosine down to its last share."""
    if step < WARM_UP_STEPS:
        return rate * (step + 1) / WARM_UP_STEPS
    done = (step - WARM_UP_STEPS) / max(1, steps - WARM_UP_STEPS)
    return rate * (LAST_RATE + (1 - LAST_RATE) * 0.5 * (1 + math.cos(math.pi * min(1.0, done))))


def train(plan: Plan) -> None:
    """Runs or resumes a plan to its last step."""
    run = Run(plan)
    run.go()


class Run:
    """A training under way."""

    def __init__(self, plan: Plan):
        self.plan, self.options = plan, plan.options
        cv2.setNumThreads(1)
        if self.options.threads:
            torch.set_num_threads(self.options.threads)
        self.device = device_from(self.options.device)
        self.autocast = autocast_from(self.device, self.options.precision)
        self.model = plan.model.to(self.device)
        self.optimizer = torch.optim.AdamW(self.model.parameters(), lr=plan.rate, weight_decay=1e-3)
        self.folder = self.options.run
        self.step, self.seconds = 0, 0.0
        if self.options.resume and self._checkpoint_path().exists():
            self._load()

    def go(self) -> None:
        """Trains, logs and saves until the last step."""
        self.folder.mkdir(parents=True, exist_ok=True)
        options, saved, shot = self.options, time.monotonic(), time.monotonic()
        sums, clock = {}, time.monotonic()
        bar = tqdm(total=options.steps, initial=self.step, unit="step", desc=self.plan.name, smoothing=0.05, mininterval=5)
        for batch in self.plan.batches(self.step):
            parts = self.advance(batch)
            for name, value in parts.items():
                sums.setdefault(name, []).append(value)
            now = time.monotonic()
            self.seconds, clock = self.seconds + now - clock, now
            bar.update()
            if self.step % LOG_EVERY_STEPS == 0:
                means = {name: sum(values) / len(values) for name, values in sums.items()}
                bar.set_postfix({name: f"{value:.3f}" for name, value in means.items()})
                self._log(means)
                sums = {}
            if now - saved > 60 * options.checkpoint_minutes:
                self._save(self._checkpoint_path())
                saved = now
            if now - shot > 60 * options.snapshot_minutes:
                self._snapshot()
                shot = now
        self._save(self._checkpoint_path())
        self._snapshot()
        bar.close()

    def advance(self, batch) -> dict[str, float]:
        """One step. A loss that is not finite is dropped and counted in the log."""
        for group in self.optimizer.param_groups:
            group["lr"] = rate_at(self.step, self.options.steps, self.plan.rate)
        self.model.train()
        loss, parts = self.plan.loss(self.model, batch.to(self.device), self.autocast)
        sound = self._update(loss)
        self.step += 1
        return {"loss": float(loss.detach())} | parts | {"dropped": float(not sound)}

    def _update(self, loss: torch.Tensor) -> bool:
        """One step down the gradient, if it is finite."""
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(self.model.parameters(), CLIP_NORM)
        sound = bool(torch.isfinite(loss)) and bool(torch.isfinite(norm))
        if sound:
            self.optimizer.step()
        return sound

    def _checkpoint_path(self) -> Path:
        return self.folder / "checkpoint.pt"

    def _state(self) -> dict:
        return {
            "name": self.plan.name,
            "model": self.model.state_dict(),
            "step": self.step,
            "pairs": self.step * self.options.batch,
            "seconds": self.seconds,
            "seed": self.options.seed,
            "facts": self.plan.facts,
        }

    def _save(self, path: Path) -> None:
        write_atomically(path, self._state() | {"optimizer": self.optimizer.state_dict()})

    def _snapshot(self) -> None:
        (self.folder / "snapshots").mkdir(exist_ok=True)
        write_atomically(self.folder / "snapshots" / f"{self.step:07d}.pt", self._state())

    def _load(self) -> None:
        state = torch.load(self._checkpoint_path(), map_location=self.device, weights_only=True)
        if (state["name"], state["seed"]) != (self.plan.name, self.options.seed):
            raise ValueError(
                f"{self._checkpoint_path()} is of {state['name']} with seed {state['seed']}, not of {self.plan.name} with "
                f"seed {self.options.seed}: name another --run or start over with --no-resume"
            )
        self.model.load_state_dict(state["model"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.seconds = state["step"], state["seconds"]
        self._drop_log_after(self.step)

    def _drop_log_after(self, step: int) -> None:
        path = self.folder / "log.csv"
        if path.exists():
            lines = path.read_text().splitlines(keepends=True)
            path.write_text("".join(lines[:1] + [l for l in lines[1:] if int(l.split(",")[0]) <= step]))

    def _log(self, means: dict[str, float]) -> None:
        path = self.folder / "log.csv"
        fresh = not path.exists()
        row = {"step": self.step, "pairs": self.step * self.options.batch, "minutes": f"{self.seconds / 60:.2f}"}
        row |= {name: f"{value:.4f}" for name, value in means.items()}
        with path.open("a", newline="") as file:
            writer = csv.DictWriter(file, row.keys())
            if fresh:
                writer.writeheader()
            writer.writerow(row)


def write_atomically(path: Path, state: dict) -> None:
    """A file that is either the old one or the whole new one."""
    temporary = path.with_suffix(".tmp")
    torch.save(state, temporary)
    os.replace(temporary, path)
