//! Fast marching on the maze that `tests/interop/fmm_peers.py` gives to its peers, too.
//!
//! `fmm_peers --write MAZE [SEED]` draws a maze of 480x480 cells; `fmm_peers MAZE N TIMES` marches over it N times, prints the
//! milliseconds of each and writes the arrival times.
//!
//! A maze file, little-endian: width, height, the source's column and row (u32 each), then a byte per cell, row by row, 1
//! for a wall. Arrival times: f32 per cell, in cells, infinite where the front did not come.

use std::time::Instant;

use homing_core::GridGeometry;
use homing_planner::{Marcher, Until, Window};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Cells along a side of the maze.
const SIDE: usize = 480;
/// Cells from one wall to the next: a metre at 5 cm.
const ROOM: usize = 20;
/// Cells that a wall is thick.
const WALL: usize = 3;

fn main() -> Fallible<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["--write", path] => Ok(std::fs::write(path, Maze::draw(1).to_bytes())?),
        ["--write", path, seed] => Ok(std::fs::write(path, Maze::draw(seed.parse()?).to_bytes())?),
        [maze, n, times] => {
            let arrival = march(&Maze::from_bytes(&std::fs::read(maze)?)?, n.parse()?);
            Ok(std::fs::write(times, arrival.iter().flat_map(|t| t.to_le_bytes()).collect::<Vec<u8>>())?)
        }
        _ => Err("fmm_peers --write MAZE [SEED] | MAZE N TIMES".into()),
    }
}

/// Marches over all of the maze `n` times and prints how long each took. Returns the arrival times.
fn march(maze: &Maze, n: usize) -> Vec<f32> {
    let geometry =
        GridGeometry { width: maze.width, height: maze.height, resolution_m: 1.0, origin_x_m: 0.0, origin_y_m: 0.0 };
    let window = Window { column_min: 1, column_max: maze.width - 1, row_min: 1, row_max: maze.height - 1 };
    let mut marcher = Marcher::new(geometry);
    for _ in 0..n {
        let start = Instant::now();
        marcher.march(
            maze.source,
            &window,
            Until::Everywhere,
            |i| if maze.walls[i] == 1 { f32::INFINITY } else { 1.0 },
        );
        println!("{:.4}", start.elapsed().as_secs_f64() * 1e3);
    }
    marcher.arrival().to_vec()
}

struct Maze {
    width: usize,
    height: usize,
    /// Index of the cell where the front starts.
    source: usize,
    walls: Vec<u8>,
}

impl Maze {
    /// Rooms on a square lattice, joined to a tree by a depth-first walk, so that one way leads from any cell to any other.
    fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rooms = SIDE / ROOM;
        let mut walls = vec![1; SIDE * SIDE];
        let mut open = |column: usize, row: usize, columns: usize, rows: usize| {
            for r in row..row + rows {
                walls[r * SIDE + column..][..columns].fill(0);
            }
        };
        let (inner, first) = (ROOM - WALL, WALL / 2 + 1);
        let corner = |room: (usize, usize)| (room.0 * ROOM + first, room.1 * ROOM + first);
        let mut seen = vec![false; rooms * rooms];
        let mut way = vec![(rooms / 2, rooms / 2)];
        while let Some(&(x, y)) = way.last() {
            seen[y * rooms + x] = true;
            open(corner((x, y)).0, corner((x, y)).1, inner, inner);
            let ahead: Vec<(usize, usize)> = [(1, 0), (-1, 0), (0, 1), (0, -1)]
                .into_iter()
                .filter_map(|(dx, dy)| Some((x.checked_add_signed(dx)?, y.checked_add_signed(dy)?)))
                .filter(|&(x, y)| x < rooms && y < rooms && !seen[y * rooms + x])
                .collect();
            if ahead.is_empty() {
                way.pop();
                continue;
            }
            let next = ahead[rng.random_range(0..ahead.len())];
            let (from, to) = (corner((x, y)), corner(next));
            let (column, row) = (from.0.min(to.0), from.1.min(to.1));
            open(column, row, inner + from.0.abs_diff(to.0), inner + from.1.abs_diff(to.1));
            way.push(next);
        }
        let middle = (rooms / 2) * ROOM + ROOM / 2;
        Self { width: SIDE, height: SIDE, source: middle * SIDE + middle, walls }
    }

    fn to_bytes(&self) -> Vec<u8> {
        let head = [self.width, self.height, self.source % self.width, self.source / self.width];
        head.iter().flat_map(|&n| (n as u32).to_le_bytes()).chain(self.walls.iter().copied()).collect()
    }

    fn from_bytes(bytes: &[u8]) -> Fallible<Self> {
        let (head, walls) = bytes.split_at_checked(16).ok_or("the file is too short")?;
        let number = |i: usize| head[4 * i..4 * i + 4].iter().rev().fold(0_usize, |n, &b| n << 8 | usize::from(b));
        let (width, height) = (number(0), number(1));
        if walls.len() != width * height {
            return Err(format!("{} cells for a maze of {width}x{height}", walls.len()).into());
        }
        Ok(Self { width, height, source: number(3) * width + number(2), walls: walls.to_vec() })
    }
}
