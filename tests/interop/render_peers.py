"""The renderer beside ViZDoom: colour and depth at 640x480, in one run, taking turns: A B A B, one core.

    cargo build --workspace --examples
    python3 -m venv target/peers && target/peers/bin/pip install -r tests/interop/peers.txt
    target/peers/bin/python tests/interop/render_peers.py [--rounds 7] [--frames 150] [--seed 12] [--json figures.json]

Ours draws a generated flat at full texture from poses on a walk through it; ViZDoom plays its indoor scenario `my_way_home`
with RGB24 and its depth buffer, at random actions. Both as their users get them: ViZDoom from Python, its game's step
included, which is small. The scenes are not alike: Doom draws a few hundred columns and floors of flat walls by a BSP
tree, 90 degrees wide, 8 bits of depth; ours some ten thousand triangles with filtered textures and baked light, 120 degrees
wide, depth in metres. Printed: frames a second by the clock and by processor time, which other work on the machine hardly
touches, and ours over theirs.
"""

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import vizdoom

ROOT = Path(__file__).resolve().parents[2]
TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


class Doom:
    """A game that is drawn frame by frame."""

    def __init__(self, seed, folder):
        before = self.children()
        self.game = vizdoom.DoomGame()
        self.game.load_config(os.path.join(vizdoom.scenarios_path, "my_way_home.cfg"))
        self.game.set_doom_config_path(os.path.join(folder, "vizdoom.ini"))
        self.game.set_window_visible(False)
        self.game.set_mode(vizdoom.Mode.PLAYER)
        self.game.set_screen_resolution(vizdoom.ScreenResolution.RES_640X480)
        self.game.set_screen_format(vizdoom.ScreenFormat.RGB24)
        self.game.set_depth_buffer_enabled(True)
        self.game.set_render_hud(False)
        self.game.set_seed(seed)
        self.game.init()
        self.engine = (self.children() - before).pop()
        self.rng = random.Random(seed)

    @staticmethod
    def children():
        return {int(pid) for task in Path("/proc/self/task").iterdir() for pid in (task / "children").read_text().split()}

    def processor_s(self):
        """Time of this process and of the engine."""
        fields = Path(f"/proc/{self.engine}/stat").read_text().rsplit(")", 1)[1].split()
        return time.process_time() + (int(fields[11]) + int(fields[12])) * TICK_S

    def draw(self, frames):
        """Milliseconds a frame by the clock and by processor time."""
        clock = processor = 0.0
        drawn = 0
        while drawn < frames:
            self.game.new_episode()
            start, start_processor = time.perf_counter(), self.processor_s()
            while drawn < frames and not self.game.is_episode_finished():
                action = [int(self.rng.random() < 0.4), int(self.rng.random() < 0.2), int(self.rng.random() < 0.8)]
                self.game.make_action(action)
                state = self.game.get_state()
                if state is not None:
                    assert state.screen_buffer.shape == (480, 640, 3) and state.depth_buffer.shape == (480, 640)
                    drawn += 1
            clock += time.perf_counter() - start
            processor += self.processor_s() - start_processor
        return clock * 1e3 / drawn, processor * 1e3 / drawn


def draw_ours(example, seed, frames):
    """The same of our example, and what it says of its scene."""
    command = [example, str(seed), str(frames), "--json"]
    said = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return (said["ms"], said["cpu_ms"]), said


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--frames", type=int, default=150)
    parser.add_argument("--seed", type=int, default=12)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    example = ROOT / "target/debug/examples/render_speed"
    if not example.is_file():
        sys.exit(f"{example} is not there: cargo build --workspace --examples")
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    folder = tempfile.TemporaryDirectory()
    doom = Doom(arguments.seed, folder.name)
    doom.draw(arguments.frames)
    theirs, ours, said = [], [], {}
    for _ in range(arguments.rounds):
        theirs.append(doom.draw(4 * arguments.frames))
        took, said = draw_ours(example, arguments.seed, arguments.frames)
        ours.append(took)
    doom.game.close()
    theirs, ours = np.array(theirs), np.array(ours)
    print(f"vizdoom {vizdoom.__version__}, load {os.getloadavg()[0]:.1f}; {arguments.rounds} rounds, one core, 640x480 with depth")
    print(f"ours: {said['scene']}, {said['triangles_total']} triangles, {said['triangles']} of them set up in a frame")
    figures = {"scene": said["scene"], "triangles": said["triangles"], "triangles_total": said["triangles_total"]}
    for column, name in enumerate(("by the clock", "by processor time")):
        ratios = theirs[:, column] / ours[:, column]
        their_fps, our_fps = 1e3 / np.median(theirs[:, column]), 1e3 / np.median(ours[:, column])
        print(
            f"{name:<18} vizdoom {their_fps:6.1f} frames/s, ours {our_fps:6.1f}; ours/vizdoom {np.median(ratios):.3f}"
            f" ({ratios.min():.3f} to {ratios.max():.3f})"
        )
        figures[name] = {"vizdoom_fps": their_fps, "ours_fps": our_fps, "ratio": float(np.median(ratios))}
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
