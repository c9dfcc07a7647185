//! How long the planner's parts take, best of 25: mapping a 640x480 depth image, surveying a map of 24 x 24 m, and a march
//! of the fast marching method over all of it. And the mapping alone, into maps of 24, 32 and 48 m while the robot turns and
//! drives: best, mean, and processor time, which other work on the machine hardly touches.

#[path = "../tests/world/mod.rs"]
mod world;

use homing_core::*;
use homing_planner::*;
use world::{USUAL, World};

const LEVEL: PlanarPose = PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: 0.0 };

fn everything(g: &GridGeometry) -> Window {
    Window { column_min: 1, column_max: g.width - 1, row_min: 1, row_max: g.height - 1 }
}

fn main() {
    let mut world = World::flat(5, (3.0, 10.0), USUAL);
    world.image = (640, 480);
    let seen = world.observe();
    let mut mapper = Mapper::new(GridGeometry::centred(24.0, 0.05), MapperConfig::default());
    let best = |mut f: Box<dyn FnMut() + '_>| {
        f();
        (0..25)
            .map(|_| {
                let t = std::time::Instant::now();
                f();
                t.elapsed().as_secs_f64() * 1e3
            })
            .fold(f64::INFINITY, f64::min)
    };
    let map_ms = best(Box::new(|| {
        mapper.integrate(&seen.depth, &seen.intrinsics, &seen.t_base_camera, &LEVEL);
    }));
    // Rooms of 4 m with staggered doors on 24 x 24 m, as in a maze.
    let g = GridGeometry::centred(24.0, 0.05);
    let wall =
        |c: usize, r: usize| (c % 80 < 3 && (r + c / 80 * 37) % 80 > 18) || (r % 80 < 3 && (c + r / 80 * 37) % 80 > 18);
    let mut map = OccupancyGrid { geometry: g, cells: vec![Cell::Free; g.len()] };
    for (c, r) in everything(&g).cells() {
        if wall(c, r) {
            map.cells[g.index(c, r)] = Cell::Occupied;
        }
    }
    let mut terrain = Terrain::new(g, &BodyConfig::default(), UnknownCells::Closed);
    let survey_ms = best(Box::new(|| terrain.survey(&map, everything(&g))));
    let mut marcher = Marcher::new(g);
    let from = g.index(40, 40);
    let march_ms =
        best(Box::new(|| marcher.march(from, &everything(&g), Until::Everywhere, |i| terrain.distance_cost(&map, i))));
    let reached = marcher.arrival().iter().filter(|t| t.is_finite()).count();
    for side_m in [24.0, 32.0, 48.0] {
        map_frames(&mut world, side_m);
    }
    println!(
        "640x480 depth {map_ms:.2} ms; 480x480: survey {survey_ms:.2} ms, march {march_ms:.2} ms over {reached} cells"
    );
}

/// Frames as they come while the robot drives through its flat, each mapped ten times over.
fn map_frames(world: &mut World, side_m: f64) {
    let geometry = GridGeometry::centred(side_m, 0.05);
    let mut mapper = Mapper::new(geometry, MapperConfig::default());
    let (mut best, mut sum, mut cpu_ms, mut n) = (f64::INFINITY, 0.0, 0.0, 0_u32);
    for step in 0..48 {
        world.apply(if step % 4 == 3 { Action::Forward } else { Action::TurnLeft });
        let seen = world.observe();
        let pose = seen.odometry.t_odom_base.planar();
        mapper.integrate(&seen.depth, &seen.intrinsics, &seen.t_base_camera, &pose);
        let begin_cpu = world::cpu_ms();
        for _ in 0..10 {
            let begin = std::time::Instant::now();
            mapper.integrate(&seen.depth, &seen.intrinsics, &seen.t_base_camera, &pose);
            let ms = begin.elapsed().as_secs_f64() * 1e3;
            (best, sum, n) = (best.min(ms), sum + ms, n + 1);
        }
        cpu_ms += world::cpu_ms() - begin_cpu;
    }
    println!(
        "640x480 depth into {side_m} x {side_m} m at 5 cm ({} cells): best {best:.2} ms, mean {:.2} ms, processor {:.2} ms",
        geometry.len(),
        sum / f64::from(n),
        cpu_ms / f64::from(n)
    );
}
