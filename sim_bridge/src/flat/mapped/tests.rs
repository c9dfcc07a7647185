#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::path::PathBuf;

use super::*;
use crate::arena::{Arena, ArenaError, BodySize, SceneRef};

const AGENT: BodySize = BodySize { radius_m: AGENT_RADIUS_M, height_m: AGENT_HEIGHT_M };

/// A folder for this process's files, by the test's name.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("homing-map-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Two rooms with a door between them, and a table in the second.
fn drawn() -> image::GrayImage {
    image::GrayImage::from_fn(60, 40, |x, y| {
        let room = (4..56).contains(&x) && (4..36).contains(&y);
        let wall = (28..31).contains(&x) && !(18..26).contains(&y);
        let table = (42..50).contains(&x) && (14..20).contains(&y);
        image::Luma([u8::from(room && !wall && !table)])
    })
}

fn written(name: &str, image: &image::GrayImage, description: &str) -> PathBuf {
    let path = folder(name).join("Drawn_0.25.png");
    image.save(&path).unwrap();
    std::fs::write(path.with_extension("toml"), description).unwrap();
    path
}

const SCALE: &str = "metres_per_pixel = 0.12\nx_at_row_0_m = 10.0\nz_at_column_0_m = -3.0\n";

#[test]
fn what_the_map_calls_navigable_is_free_and_what_it_closes_is_not() {
    let path = written("free", &drawn(), SCALE);
    let map = NavMap::read(&path).unwrap();
    assert!((map.floor_y_m - 0.25).abs() < 1e-12);
    let arena = Arena::load_as(&SceneRef::Layout { map: path }, AGENT, Detail::Shape).unwrap();
    let (mut free, mut n) = (0, 0);
    for row in 0..map.geometry.height {
        for column in 0..map.geometry.width {
            if map.navigable[map.geometry.index(column, row)] {
                let (x, y) = map.geometry.centre(column, row);
                n += 1;
                free += u32::from(arena.space().contains(x, y));
            }
        }
    }
    assert_eq!(free, n, "the centres of all navigable pixels");
    // Row 17, column 46 is the middle of the table; row 10, column 29 that of the wall. x = 10 - 0.12 row, z = 0.12
    // column - 3.
    for (row, column) in [(17.0, 46.0), (10.0, 29.5)] {
        let (x, y) = (10.0 - 0.12 * row, -(0.12 * column - 3.0));
        assert!(!arena.space().contains(x, y), "row {row}, column {column}");
    }
    let area = f64::from(n) * 0.12 * 0.12;
    assert!((arena.space().area_m2() / area - 1.0).abs() < 0.08, "{} for {area}", arena.space().area_m2());
}

#[test]
fn equal_maps_give_equal_scenes_and_others_other_ones() {
    let read = |name: &str, image: &image::GrayImage| NavMap::read(&written(name, image, SCALE)).unwrap();
    let (a, again) = (read("equal", &drawn()), read("again", &drawn()));
    assert_eq!(build(&a, Detail::Full).unwrap(), build(&again, Detail::Full).unwrap());
    let mut other = drawn();
    other.put_pixel(10, 10, image::Luma([0]));
    assert_ne!(a.seed(), read("other", &other).seed());
}

#[test]
fn a_mapped_scene_is_varied_and_of_sensible_size() {
    let scene = build(&NavMap::read(&written("varied", &drawn(), SCALE)).unwrap(), Detail::Full).unwrap();
    let n: usize = scene.meshes.iter().map(|m| m.triangles.len()).sum();
    assert!((1_000..60_000).contains(&n), "{n} triangles");
    assert!(scene.textures.len() >= 15, "{} textures", scene.textures.len());
    assert!(scene.lamps.len() >= 2);
    for mesh in &scene.meshes {
        assert!(mesh.vertices.iter().all(|v| v.position.iter().chain(&v.normal).all(|f| f.is_finite())));
        assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.vertices.len()));
    }
}

#[test]
fn what_is_no_map_is_refused_with_the_reason() {
    let refused = |path: &PathBuf| {
        let error = Arena::load_as(&SceneRef::Layout { map: path.clone() }, AGENT, Detail::Shape).err().unwrap();
        assert!(matches!(error, ArenaError::Map(_)), "{error}");
        let text = error.to_string();
        assert!(text.contains(&path.file_stem().unwrap().to_string_lossy().into_owned()), "{text}");
        text
    };
    let one_colour = written("colour", &image::GrayImage::from_pixel(50, 50, image::Luma([1])), SCALE);
    assert!(refused(&one_colour).contains("every pixel"));
    let mut speck = image::GrayImage::new(50, 50);
    speck.put_pixel(20, 20, image::Luma([1]));
    assert!(refused(&written("speck", &speck, SCALE)).contains("square metre"));
    assert!(refused(&written("key", &drawn(), "scale = 1.0")).contains("unknown field"));
    assert!(refused(&written("scale", &drawn(), "metres_per_pixel = 0.0")).contains("must be from"));
    let picture = folder("rgb").join("Picture.png");
    image::RgbImage::new(20, 20).save(&picture).unwrap();
    assert!(refused(&picture).contains("8-bit grey"));
    let specks = image::GrayImage::from_fn(300, 300, |x, y| image::Luma([u8::from(x % 4 > 0 || y % 4 > 0)]));
    assert!(refused(&written("specks", &specks, SCALE)).contains("separate outlines"));
    let text = folder("text").join("Text.png");
    std::fs::write(&text, "no image").unwrap();
    assert!(refused(&text).contains("not an image"));
    assert!(refused(&folder("none").join("Nowhere.png")).contains("cannot read"));
}

#[test]
fn rectangles_cover_every_cell_of_a_room_once() {
    let cells: Vec<Option<u32>> =
        "00.11 00011 .0011".split(' ').flat_map(|r| r.chars().map(|c| c.to_digit(10))).collect();
    let mut seen = vec![None; cells.len()];
    for (room, columns, rows) in rectangles(&cells, 5) {
        for row in rows.0..rows.1 {
            for column in columns.0..columns.1 {
                assert_eq!(seen[5 * row + column].replace(room), None);
            }
        }
    }
    assert_eq!(seen, cells);
}
