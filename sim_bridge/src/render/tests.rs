#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use homing_core::Transform;
use nalgebra::{Matrix3, Point3, Vector3};

use super::*;
use crate::scene::{Lamp, Material, Mesh, Texture, Vertex};

fn camera() -> Intrinsics {
    Intrinsics::from_hfov(160, 120, 2.0).unwrap()
}

/// Looks along world x from `eye`, z up.
fn looking_along_x(eye: [f64; 3]) -> Transform<World, Camera> {
    let r_world_camera = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    Transform::from_rotation(&r_world_camera, Vector3::from(eye))
}

fn material(texture: Option<usize>) -> Material {
    Material { base_colour: [1.0; 4], texture, double_sided: false, alpha_cutoff: 0.0, unlit: true }
}

/// A quad from its corners, counter-clockwise seen from outside; uv runs 0 to `repeats`.
fn quad(corners: [[f32; 3]; 4], normal: [f32; 3], repeats: f32) -> Mesh {
    let uvs = [[0.0, 0.0], [repeats, 0.0], [repeats, repeats], [0.0, repeats]];
    let vertices = corners.iter().zip(uvs).map(|(position, uv)| Vertex { position: *position, normal, uv }).collect();
    Mesh { vertices, colours: vec![], triangles: vec![[0, 1, 2], [0, 2, 3]], material: 0, solid: true }
}

/// A wall across the view at `x`, facing the camera that looks along x.
fn wall(x: f32, half: f32, repeats: f32) -> Mesh {
    quad([[x, half, -half], [x, -half, -half], [x, -half, half], [x, half, half]], [-1.0, 0.0, 0.0], repeats)
}

fn floor(half: f32, repeats: f32) -> Mesh {
    quad([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]], [0.0, 0.0, 1.0], repeats)
}

fn scene(meshes: Vec<Mesh>) -> Scene {
    Scene { name: "test".into(), meshes, materials: vec![material(None)], textures: vec![], lamps: vec![] }
}

fn checkerboard(side: u32) -> Texture {
    let cell = |i: u32| if (i % side + i / side).is_multiple_of(2) { [0, 0, 0, 255] } else { [255, 255, 255, 255] };
    Texture { width: side, height: side, rgba: (0..side * side).flat_map(cell).collect() }
}

fn draw(scene: Scene, pose: &Transform<World, Camera>) -> (RgbImage, DepthImage) {
    Renderer::new(Arc::new(scene)).render(&camera(), pose)
}

#[test]
fn a_wall_has_its_depth_along_the_axis_in_every_pixel() {
    let (_, depth) = draw(scene(vec![wall(2.5, 40.0, 1.0)]), &looking_along_x([0.0; 3]));
    assert!(depth.data().iter().all(|d| (d - 2.5).abs() < 1e-5));
}

#[test]
fn a_floor_seen_at_a_grazing_angle_has_the_depth_of_the_plane() {
    let eye = [0.0, 0.0, 1.25];
    let (_, depth) = draw(scene(vec![floor(30.0, 1.0)]), &looking_along_x(eye));
    let k = camera();
    let mut seen = 0;
    for row in 62..120 {
        for column in 0..160 {
            let expected = 1.25 * k.fy() / (f64::from(row) - k.cy());
            let lateral = expected * (f64::from(column) - k.cx()) / k.fx();
            if expected < 29.9 && lateral.abs() < 29.9 {
                let found = f64::from(depth.at(column, row).unwrap());
                assert!((found - expected).abs() < 1e-5 * expected, "({column}, {row}): {found} for {expected}");
                seen += 1;
            }
        }
    }
    assert!(seen > 8000, "{seen} floor pixels");
}

#[test]
fn pixels_belong_to_the_surface_under_their_centre() {
    // Its left edge projects between the centres of columns 100 and 101, its top edge between rows 70 and 71.
    let k = camera();
    let pose = looking_along_x([0.0; 3]);
    let corner = |x: f64, y: f64| pose.apply(&k.unproject(x, y, 3.0)).coords.map(|c| c as f32).into();
    let corners: [[f32; 3]; 4] = [corner(100.4, 90.0), corner(140.0, 90.0), corner(140.0, 70.4), corner(100.4, 70.4)];
    let (_, depth) = draw(scene(vec![quad(corners, [-1.0, 0.0, 0.0], 1.0)]), &pose);
    assert_eq!(depth.at(100, 80), None);
    assert!(depth.at(101, 80).is_some());
    assert_eq!(depth.at(120, 70), None);
    assert!(depth.at(120, 71).is_some());
    let back = k.project(&pose.inverse().apply(&Point3::from(corners[3].map(f64::from)))).unwrap();
    assert!((back.x - 100.4).abs() < 1e-3 && (back.y - 70.4).abs() < 1e-3);
}

#[test]
fn the_nearer_of_two_surfaces_is_seen_and_the_first_of_two_equal_ones() {
    let mut near = wall(2.0, 40.0, 1.0);
    near.material = 1;
    let mut twin = near.clone();
    twin.material = 0;
    let mut both = scene(vec![wall(3.0, 40.0, 1.0), near, twin]);
    both.materials = vec![material(None), Material { base_colour: [1.0, 0.0, 0.0, 1.0], ..material(None) }];
    let (rgb, depth) = draw(both, &looking_along_x([0.0; 3]));
    assert!(depth.data().iter().all(|d| (d - 2.0).abs() < 1e-5));
    assert!(rgb.data().chunks_exact(3).all(|p| p == [255, 0, 0]));
}

#[test]
fn a_floor_below_and_behind_the_camera_is_cut_at_the_near_plane() {
    // Its triangles reach 30 m behind the camera, which hovers 1 cm above it.
    let (rgb, depth) = draw(scene(vec![floor(30.0, 1.0)]), &looking_along_x([0.0, 0.0, 0.01]));
    let nearest = depth.data().iter().copied().filter(|d| *d > 0.0).fold(f32::MAX, f32::min);
    assert!(f64::from(nearest) >= NEAR_M * 0.999, "nearest {nearest}");
    for column in 0..160 {
        assert!(depth.at(column, 62).is_some(), "hole below the horizon in column {column}");
        assert_eq!(depth.at(column, 57), None, "floor above the horizon in column {column}");
    }
    assert_eq!(rgb.data().len(), 160 * 120 * 3);
}

#[test]
fn surfaces_facing_away_are_not_drawn_unless_double_sided() {
    let pose = looking_along_x([5.0, 0.0, 0.0]);
    let turned =
        Transform::from_rotation(&Matrix3::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0), pose.translation());
    let mut one = scene(vec![wall(2.0, 40.0, 1.0)]);
    assert_eq!(draw(one.clone(), &turned).1.valid_share(), 0.0);
    one.materials[0].double_sided = true;
    assert_eq!(draw(one, &turned).1.valid_share(), 1.0);
}

#[test]
fn a_fine_checkerboard_far_away_is_even_grey() {
    let mut far = scene(vec![wall(20.0, 60.0, 60.0)]);
    far.materials = vec![material(Some(0))];
    far.textures = vec![checkerboard(64)];
    let (rgb, _) = draw(far, &looking_along_x([0.0; 3]));
    // Half of all light, sRGB code 188.
    assert!(rgb.data().iter().all(|c| c.abs_diff(188) <= 2), "{:?}", &rgb.data()[..12]);
}

#[test]
fn a_texture_seen_from_near_shows_its_texels() {
    let mut near = scene(vec![wall(2.0, 2.0, 1.0)]);
    near.materials = vec![material(Some(0))];
    near.textures = vec![checkerboard(2)];
    let (rgb, _) = draw(near, &looking_along_x([0.0; 3]));
    let k = camera();
    let pixel = |y: f64, z: f64| {
        let p = k.project(&Point3::new(-y, -z, 2.0)).unwrap();
        rgb.data()[3 * (p.y.round() as usize * 160 + p.x.round() as usize)]
    };
    // Vertex 0 (y = 2, z = -2) has uv (0, 0): the first texel, black, is the quarter around it.
    assert!(pixel(1.0, -1.0) < 12 && pixel(-1.0, 1.0) < 12);
    assert!(pixel(-1.0, -1.0) > 243 && pixel(1.0, 1.0) > 243);
}

#[test]
fn holes_show_what_is_behind() {
    let mut fence = wall(2.0, 2.0, 1.0);
    fence.material = 1;
    let mut two = scene(vec![wall(4.0, 40.0, 1.0), fence]);
    let rgba = vec![255, 255, 255, 0, 255, 255, 255, 255];
    two.textures = vec![Texture { width: 2, height: 1, rgba }];
    two.materials.push(Material { alpha_cutoff: 0.5, ..material(Some(0)) });
    let (_, depth) = draw(two, &looking_along_x([0.0; 3]));
    let k = camera();
    let at = |y: f64| {
        let p = k.project(&Point3::new(-y, 0.0, 2.0)).unwrap();
        depth.at(p.x.round() as u32, p.y.round() as u32).unwrap()
    };
    assert!((at(1.0) - 4.0).abs() < 1e-5, "hole");
    assert!((at(-1.0) - 2.0).abs() < 1e-5, "board");
}

#[test]
fn the_same_bits_whatever_the_number_of_threads() {
    let mut lit = scene(vec![floor(8.0, 16.0), wall(4.0, 3.0, 4.0), wall(6.0, 9.0, 5.0)]);
    lit.materials = vec![Material { unlit: false, ..material(Some(0)) }];
    lit.textures = vec![checkerboard(32)];
    lit.lamps = vec![Lamp { position: [2.0, 1.0, 2.4], colour: [1.0, 0.9, 0.8], reach_m: 6.0 }];
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw(lit.clone(), &looking_along_x([0.0, 0.0, 1.2])))
    };
    assert_eq!(in_pool(1), in_pool(4));
}

#[test]
fn nothing_to_see_gives_no_depth() {
    let (rgb, depth) = draw(Scene::default(), &looking_along_x([0.0; 3]));
    assert_eq!(depth.valid_share(), 0.0);
    assert_eq!(rgb.width(), 160);
    let nowhere = looking_along_x([f64::NAN, 0.0, 0.0]);
    assert_eq!(draw(scene(vec![wall(2.0, 40.0, 1.0)]), &nowhere).1.valid_share(), 0.0);
}

#[test]
fn broken_triangles_are_left_out() {
    let mut mesh = wall(2.0, 40.0, 1.0);
    mesh.triangles.push([0, 1, 99]);
    mesh.vertices.push(Vertex { position: [f32::NAN; 3], normal: [0.0; 3], uv: [f32::NAN; 2] });
    mesh.triangles.push([0, 1, 4]);
    mesh.triangles.push([1, 1, 1]);
    let (_, depth) = draw(scene(vec![mesh]), &looking_along_x([0.0; 3]));
    assert!(depth.data().iter().all(|d| (d - 2.0).abs() < 1e-5));
}
