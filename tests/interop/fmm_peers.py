"""Fast marching beside its peers, on one maze, in one run: A B A B, one core.

    cargo build --workspace --examples
    python3 -m venv target/peers && target/peers/bin/pip install -r tests/interop/peers.txt
    target/peers/bin/python tests/interop/fmm_peers.py [--rounds 9] [--marches 5] [--seed 1] [--json figures.json]

Peers: scikit-fmm from Python, on a masked array, as its users call it (travel_time and distance; first order, which is
ours, too), and the crate `eikonal`, which a program made and built here, under target/peers, calls from Rust. All march over
all that can be reached in a maze of 480x480 cells, drawn by our example. Clocks cover the march alone: arrays are made
before. Printed: milliseconds by the clock (median of each round's best march) and of processor time (mean of all marches),
which other work on the machine hardly touches, ours over theirs by both, and how far arrival times are from ours, in cells:
scikit-fmm's front starts between cells, half a cell earlier, which is taken out.
"""

import argparse
import json
import os
import resource
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import skfmm

ROOT = Path(__file__).resolve().parents[2]
CRATE = ROOT / "target/peers/eikonal"
OURS = "ours"

MANIFEST = """\
[package]
name = "eikonal-peer"
version = "0.0.0"
edition = "2021"
[dependencies]
eikonal = "=0.1.0"
ndarray = "0.17"
[workspace]
"""

PROGRAM = """\
use std::time::Instant;
fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&arguments[1]).unwrap();
    let number = |i: usize| u32::from_le_bytes(bytes[4 * i..4 * i + 4].try_into().unwrap()) as usize;
    let walls = ndarray::Array2::from_shape_fn((number(1), number(0)), |(r, c)| bytes[16 + r * number(0) + c] == 1);
    let cost = eikonal::CostField::with_obstacles(&walls);
    let mut times = Vec::new();
    for _ in 0..arguments[2].parse::<usize>().unwrap() {
        let start = Instant::now();
        let solved = eikonal::solve(&cost, (number(3), number(2))).unwrap();
        println!("{:.4}", start.elapsed().as_secs_f64() * 1e3);
        times = solved.distance().iter().map(|t| *t as f32).collect();
    }
    std::fs::write(&arguments[3], times.iter().flat_map(|t| t.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
}
"""


def build_eikonal():
    """The program that calls the crate, optimised."""
    (CRATE / "src").mkdir(parents=True, exist_ok=True)
    for path, text in ((CRATE / "Cargo.toml", MANIFEST), (CRATE / "src/main.rs", PROGRAM)):
        if not path.is_file() or path.read_text() != text:
            path.write_text(text)
    target = CRATE / "target"
    subprocess.run(["cargo", "build", "--release", "--quiet", "--target-dir", target], check=True, cwd=CRATE)
    return target / "release/eikonal-peer"


def run_program(program, maze, marches):
    """Milliseconds of each march, mean processor time of one, and the arrival times of the last, in cells."""
    with tempfile.NamedTemporaryFile() as times:
        used = []
        for n in (0, marches):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [program, maze, str(n), times.name]
            lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            used.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
        field = np.fromfile(times.name, np.float32).astype(float)
    return [float(ms) for ms in lines], (used[1] - used[0]) * 1e3 / marches, field


def run_skfmm(solve, marches):
    """The same, of a call into scikit-fmm."""
    milliseconds = []
    used = time.process_time()
    for _ in range(marches):
        start = time.perf_counter()
        field = solve()
        milliseconds.append((time.perf_counter() - start) * 1e3)
    used = (time.process_time() - used) * 1e3 / marches
    return milliseconds, used, np.ma.filled(field, np.inf).ravel()


def read(path):
    """Walls, and scikit-fmm's front around the source, as masked arrays."""
    data = path.read_bytes()
    width, height, column, row = struct.unpack("<4I", data[:16])
    walls = np.frombuffer(data[16:], np.uint8).reshape(height, width).astype(bool)
    phi = np.ones(walls.shape)
    phi[row, column] = -1.0
    return walls, np.ma.MaskedArray(phi, walls), (column, row)


def solvers(maze, marches):
    """Name -> how to get milliseconds and times."""
    walls, phi, _ = read(maze)
    speed = np.ones(walls.shape)
    example, eikonal = ROOT / "target/debug/examples/fmm_peers", build_eikonal()
    if not example.is_file():
        sys.exit(f"{example} is not there: cargo build --workspace --examples")
    return {
        "scikit-fmm travel_time": lambda: run_skfmm(lambda: skfmm.travel_time(phi, speed, order=1), marches),
        OURS: lambda: run_program(example, maze, marches),
        "scikit-fmm distance": lambda: run_skfmm(lambda: skfmm.distance(phi, order=1), marches),
        "scikit-fmm travel_time, order 2": lambda: run_skfmm(lambda: skfmm.travel_time(phi, speed, order=2), marches),
        "eikonal": lambda: run_program(eikonal, maze, marches),
    }


def difference(theirs, ours, early_cells):
    """Mean and greatest relative difference beyond 20 cells, and how many cells only one of them reached."""
    both = np.isfinite(theirs) & np.isfinite(ours) & (ours > 20.0)
    relative = np.abs(theirs[both] + early_cells - ours[both]) / ours[both]
    return float(relative.mean()), float(relative.max()), int(np.sum(np.isfinite(theirs) != np.isfinite(ours)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--marches", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    with tempfile.TemporaryDirectory() as folder:
        maze = Path(folder) / "maze.bin"
        example = ROOT / "target/debug/examples/fmm_peers"
        subprocess.run([example, "--write", maze, str(arguments.seed)], check=True)
        names = solvers(maze, arguments.marches)
        best, used, times = {name: [] for name in names}, {name: [] for name in names}, {}
        for _ in range(arguments.rounds):
            for name, solve in names.items():
                milliseconds, processor_ms, times[name] = solve()
                best[name].append(min(milliseconds))
                used[name].append(processor_ms)
        n_walls = int(read(maze)[0].sum())
    n_reached = int(np.isfinite(times[OURS]).sum())
    print(f"scikit-fmm {skfmm.__version__}, eikonal 0.1.0, load {os.getloadavg()[0]:.1f}")
    print(f"480x480 cells, {n_walls} of walls, {n_reached} reached; {arguments.rounds} rounds of {arguments.marches}")
    print(f"{'':31}{'clock ms':>9}{'ours/it':>8}{'processor ms':>14}{'ours/it':>8}{'spread':>7}  difference: mean, greatest")
    figures = {}
    for name in names:
        rounds, processor = np.array(best[name]), np.array(used[name])
        ratio = float(np.median(np.array(best[OURS]) / rounds))
        processor_ratio = float(np.median(np.array(used[OURS]) / processor))
        mean, greatest, missed = difference(times[name], times[OURS], 0.5 if name.startswith("scikit") else 0.0)
        figures[name] = {"clock_ms": float(np.median(rounds)), "clock_ratio": ratio}
        figures[name] |= {"processor_ms": float(np.median(processor)), "processor_ratio": processor_ratio}
        figures[name] |= {"difference_mean": mean, "difference_max": greatest, "reached_by_one": missed}
        print(
            f"{name:<31}{np.median(rounds):9.2f}{ratio:8.2f}{np.median(processor):14.2f}{processor_ratio:8.2f}"
            f"{processor.std() / processor.mean():7.0%}  {mean:.4%}, {greatest:.4%}, {missed} cells reached by one alone"
        )
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
