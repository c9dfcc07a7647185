#![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::io::Write;
use std::path::PathBuf;

use super::*;
use crate::arena::{Arena, BodySize, SceneRef};
use crate::episode::{self, EpisodeSpec, FloorPose, Level, Shape, Viewpoint};
use crate::flat::Detail;
use crate::flat::mapped::{AGENT_HEIGHT_M, AGENT_RADIUS_M};
use crate::folds::free_viewpoint;
use crate::score::{Ending, Finish};

const AGENT: BodySize = BodySize { radius_m: AGENT_RADIUS_M, height_m: AGENT_HEIGHT_M };

/// A folder for this process's files, by the test's name.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("homing-habitat-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Two rooms of 3 m by 4 m with a door between them, and a closed chamber: Habitat's x from 0 to 4, z from 0 to 6.2.
fn layout(name: &str) -> Arena {
    let image = image::GrayImage::from_fn(80, 42, |column, row| {
        let rooms = column < 62 && row < 40 && (!(30..32).contains(&column) || (18..24).contains(&row));
        let chamber = (68..78).contains(&column) && row < 20;
        image::Luma([u8::from(rooms || chamber)])
    });
    let map = folder(name).join("Small_0.20.png");
    image.save(&map).unwrap();
    let scale = "metres_per_pixel = 0.1\nx_at_row_0_m = 4.0\nz_at_column_0_m = 0.0\n";
    std::fs::write(map.with_extension("toml"), scale).unwrap();
    Arena::load_as(&SceneRef::Layout { map }, AGENT, Detail::Shape).unwrap()
}

fn raw(start: [f64; 3], goal: [f64; 3]) -> RawEpisode {
    RawEpisode {
        id: EpisodeId::Number(2),
        scene_id: "data/scene_datasets/gibson/Small.glb".into(),
        start_position: start,
        start_rotation: [0.0, 0.0, 0.0, 1.0],
        goal: RawGoal { position: goal, rotation: None, camera: None },
        view_points: Vec::new(),
        success_m: None,
        geodesic_m: None,
        own: None,
    }
}

#[test]
fn an_episode_lands_where_the_map_has_it() {
    let arena = layout("lands");
    // Along Habitat's z, through the door: rows 18 to 24 are x 1.6 to 2.2.
    let placed = place(&raw([1.9, 0.2, 1.0], [1.9, 0.2, 5.0]), &arena).unwrap();
    assert_eq!((placed.start.x_m, placed.start.y_m), (1.9, -1.0));
    assert_eq!((placed.goal.x_m, placed.goal.y_m), (1.9, -5.0));
    assert!((placed.shortest_path_m - 4.0).abs() < 0.01, "{}", placed.shortest_path_m);
    // At rest an agent looks along -z, our +y. The goal's heading is numpy's for episode 2, a quarter turn on.
    assert!((placed.start.yaw_rad - core::f64::consts::FRAC_PI_2).abs() < 1e-6);
    let expected = homing_core::wrap_angle(2.7394367631438397 + core::f64::consts::FRAC_PI_2);
    assert!((placed.goal.yaw_rad - expected).abs() < 1e-6);
    assert_eq!((placed.id.as_deref(), placed.success_m), (Some("2"), 1.0));
    assert_eq!(placed.camera, Viewpoint::default());
}

#[test]
fn points_just_outside_are_moved_in_and_others_refused() {
    let arena = layout("outside");
    let placed = place(&raw([1.9, 0.2, -0.2], [1.9, 0.2, 5.0]), &arena).unwrap();
    assert!(arena.space().contains(placed.start.x_m, placed.start.y_m));
    assert!((placed.start.y_m - 0.2).abs() < 0.25);
    let reason = |start, goal| place(&raw(start, goal), &arena).unwrap_err().reason();
    assert_eq!(reason([1.9, 0.2, -0.6], [1.9, 0.2, 5.0]), "start blocked");
    assert_eq!(reason([0.5, 0.2, 1.0], [3.6, 0.2, 6.9]), "goal blocked");
    assert_eq!(reason([1.9, 0.35, 1.0], [1.9, 0.2, 5.0]), "other floor");
    assert_eq!(reason([1.9, 0.2, 1.0], [1.9, 2.9, 5.0]), "other floor");
    // The chamber is no part of the largest connected floor.
    assert_eq!(reason([1.9, 0.2, 1.0], [3.0, 0.2, 7.3]), "goal blocked");
    assert_eq!(reason([1.9, 0.2, f64::NAN], [1.9, 0.2, 5.0]), "no pose");
    let elsewhere = RawEpisode { scene_id: "gibson/Other.glb".into(), ..raw([1.9, 0.2, 1.0], [1.9, 0.2, 5.0]) };
    let refusal = place(&elsewhere, &arena).unwrap_err();
    assert_eq!(refusal.to_string(), "it takes place in Other, and this is Small");
    let spun = RawEpisode { start_rotation: [0.0; 4], ..raw([1.9, 0.2, 1.0], [1.9, 0.2, 5.0]) };
    assert_eq!(place(&spun, &arena).unwrap_err().reason(), "no pose");
}

#[test]
fn our_episodes_survive_a_file() {
    let flat = Arena::load_as(&SceneRef::Flat { seed: 300_100 }, BodySize::default(), Detail::Shape).unwrap();
    let map = layout("survive");
    for (arena, name) in [(&flat, "flat.json.gz"), (&map, "map.json")] {
        let spec =
            |seed| EpisodeSpec { min_m: 1.5, shape: None, camera: free_viewpoint(seed), ..EpisodeSpec::default() };
        let mut episodes: Vec<_> = (0..6).map(|seed| episode::draw(arena, seed, &spec(seed)).unwrap()).collect();
        episodes[1].id = Some("X_12".into());
        episodes[2].goal.yaw_rad = (core::f64::consts::PI * 1e6).round() / 1e6;
        let (x_m, y_m) = (episodes[3].goal.x_m, episodes[3].goal.y_m);
        episodes[3].view_points = vec![(x_m, y_m)];
        episodes[3].success_m = 0.1;
        let path = folder("survive").join(name);
        let raws: Vec<RawEpisode> = episodes.iter().map(|e| to_raw(e, arena)).collect();
        EpisodeFile::write(&path, &raws).unwrap();
        let read = EpisodeFile::read(&path).unwrap();
        let back: Vec<_> = read.iter().map(|r| place(r, arena).unwrap()).collect();
        assert_eq!(back, episodes, "{name}");
        let found = find_scene(&folder("survive"), &read[0].scene_id, read[0].start_position[1]).unwrap();
        assert_eq!(found, *arena.scene_ref());
    }
}

#[test]
fn the_published_formats_are_read() {
    let folder = folder("formats");
    let read = |name: &str, text: &str| {
        std::fs::write(folder.join(name), text).unwrap();
        EpisodeFile::read(&folder.join(name))
    };
    let list = r#"[{"episode_id": 7, "scene_id": "a/Small.glb", "start_position": [1, 0.2, 1], "start_rotation": [0, 0, 0, 1],
        "info": {"geodesic_distance": 4.5, "difficulty": "easy"}, "goals": [{"position": [1, 0.2, 2], "radius": null}],
        "shortest_paths": null, "start_room": null}]"#;
    let one = &read("list.json", list).unwrap()[0];
    assert_eq!((&one.id, one.geodesic_m, one.goal.rotation), (&EpisodeId::Number(7), Some(4.5), None));
    let nrns = r#"{"episodes": [{"episode_id": "Small_12", "scene_id": "gibson/Small.glb", "start_position": [1, 0.2, 1],
        "start_rotation": [0, 0, 0, 1], "goals": [{"position": [1, 0.2, 2], "rotation": [0, 1, 0, 0]}],
        "length_shortest": 3.25}]}"#;
    let one = &read("nrns.json", nrns).unwrap()[0];
    assert_eq!((one.id.to_string().as_str(), one.geodesic_m), ("Small_12", Some(3.25)));
    assert_eq!(one.goal.rotation, Some([0.0, 1.0, 0.0, 0.0]));
    assert!(read("empty.json", "[]").unwrap().is_empty());
    for (text, part) in [
        ("{", "not JSON"),
        ("3", "neither a list"),
        (r#"{"goals_by_category": {}}"#, "ObjectNav"),
        (r#"{"version": 9}"#, "no list named episodes"),
        (r#"[{"episode_id": 1}]"#, "episode 0"),
        (r#"{"episodes": [], "goals": {"a_b_1": {"position": [0, 0, 0]}}}"#, "a_b_1 is none of version 3"),
    ] {
        let error = read("wrong.json", text).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("wrong.json"), "{error}");
    }
}

#[test]
fn a_file_that_is_cut_short_says_so() {
    let path = folder("cut").join("cut.json.gz");
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(&b"[".repeat(5000)).unwrap();
    let whole = packer.finish().unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert!(matches!(EpisodeFile::read(&path), Err(HabitatError::Read { .. })));
    let nowhere = EpisodeFile::read(&folder("cut").join("nowhere.json")).unwrap_err();
    assert!(nowhere.to_string().contains("nowhere.json"));
}

const INSTANCES: &str = r#"{"goals": {"Small_chair_4": {"object_id": 4, "object_category": "chair", "position": [2, 1, 5],
    "view_points": [{"agent_state": {"position": [1.5, 0.2, 4.6], "rotation": [0, 0, 0, 1]}, "iou": 0.5},
                    {"agent_state": {"position": [2.5, 0.2, 5.0], "rotation": [0, 0, 0, 1]}, "iou": 0.5},
                    {"agent_state": {"position": [2.5, 2.9, 5.0], "rotation": [0, 0, 0, 1]}, "iou": 0.5}],
    "image_goals": [{"position": [2, 1.4, 4], "rotation": [-0.1305262, 0, 0, 0.9914449], "hfov": 79,
                     "image_dimensions": [512, 640], "object_coverage": 0.1, "frame_coverage": 0.2}]}},
  "episodes": [{"episode_id": "0", "scene_id": "hm3d/val/Small.basis.glb", "start_position": [1.9, 0.2, 1],
    "start_rotation": [0, 0, 0, 1], "object_category": "chair", "goal_object_id": 4, "goal_image_id": IMAGE, "goals": []}]}"#;

#[test]
fn instance_goals_have_their_own_camera_and_places_to_stop() {
    let path = folder("instance").join("instances.json");
    std::fs::write(&path, INSTANCES.replace("IMAGE", "0")).unwrap();
    let arena = layout("instance");
    let episode = place(&EpisodeFile::read(&path).unwrap()[0], &arena).unwrap();
    let camera = episode.camera;
    assert_eq!((camera.width, camera.height), (640, 512));
    assert!((camera.height_m - 1.2).abs() < 1e-6 && (camera.hfov_rad.to_degrees() - 79.0).abs() < 1e-9);
    assert!((camera.pitch_rad.to_degrees() + 15.0).abs() < 1e-3, "{}", camera.pitch_rad.to_degrees());
    assert_eq!((episode.view_points.len(), episode.success_m), (2, 0.1), "the third is on another floor");
    let way_m = libm::hypot(0.4, 3.6);
    assert!((episode.shortest_path_m - way_m).abs() < 0.05, "{} for {way_m}", episode.shortest_path_m);
    let (x_m, y_m) = episode.view_points[1];
    let ending = Ending {
        stopped: true,
        steps: 9,
        last_mile_steps: 0,
        path_length_m: 5.0,
        collisions: 0,
        pose: FloorPose { x_m: x_m + 0.05, y_m, yaw_rad: 0.0 }.into(),
    };
    let finish = Finish::new(&arena, &episode, &ending);
    assert!((finish.final_straight_m - 0.05).abs() < 1e-9 && finish.success_m == 0.1);
    assert!((finish.final_distance_m.unwrap() - 0.05).abs() < 0.01);
    let looking_down = camera.t_base_camera().isometry().rotation * nalgebra::Vector3::z();
    assert!((looking_down.z + libm::sin(15_f64.to_radians())).abs() < 1e-4 && looking_down.x > 0.9);
    std::fs::write(&path, INSTANCES.replace("IMAGE", "3")).unwrap();
    assert!(EpisodeFile::read(&path).unwrap_err().to_string().contains("has 1 photos, no 3"));
}

#[test]
fn a_scene_that_is_not_there_is_named() {
    let folder = folder("missing");
    let error = find_scene(&folder, "gibson/Avonia.glb", 0.16).unwrap_err().to_string();
    assert!(error.contains("Avonia.glb") && error.contains("0.16"), "{error}");
    for name in ["Convoy_0.17.png", "Convoy_0.25.png"] {
        std::fs::write(folder.join(name), "").unwrap();
    }
    let map = folder.join("Convoy_0.25.png");
    assert_eq!(find_scene(&folder, "x/Convoy.glb", 0.28).unwrap(), SceneRef::Layout { map });
    assert!(find_scene(&folder, "x/Convoy.glb", 0.4).is_err());
    std::fs::write(folder.join("Convoy.glb"), "").unwrap();
    let path = folder.join("Convoy.glb");
    assert_eq!(find_scene(&folder, "x/Convoy.glb", 0.4).unwrap(), SceneRef::Glb { path });
    assert_eq!(scene_name(&SceneRef::Layout { map: "a/My_flat_-0.5.png".into() }), "My_flat");
}

/// The share that is placed, and the median of our shortest paths over the stated ones.
#[test]
fn the_published_layouts_hold_their_episodes() {
    let folder = std::env::var_os("HOMING_DATA").map_or_else(|| PathBuf::from("../../shared/data"), PathBuf::from);
    let folder = folder.join("gibson");
    if !folder.is_dir() {
        eprintln!("SKIPPED the_published_layouts_hold_their_episodes: no {} (set HOMING_DATA)", folder.display());
        return;
    }
    for name in ["Avonia", "Brevort", "Colebrook", "Convoy"] {
        let raws = EpisodeFile::read(&folder.join(format!("{name}.json.gz"))).unwrap();
        let mut arenas: Vec<Arena> = Vec::new();
        let (mut ratios, mut refused) = (Vec::new(), std::collections::BTreeMap::new());
        let mut levels = std::collections::BTreeMap::new();
        for raw in &raws {
            let Ok(scene) = find_scene(&folder, &raw.scene_id, raw.start_position[1]) else {
                *refused.entry("no map of that floor").or_insert(0) += 1;
                continue;
            };
            if arenas.iter().all(|a| *a.scene_ref() != scene) {
                arenas.push(Arena::load_as(&scene, AGENT, Detail::Shape).unwrap());
            }
            let arena = arenas.iter().find(|a| *a.scene_ref() == scene).unwrap();
            match place(raw, arena) {
                Ok(episode) => {
                    ratios.push(episode.shortest_path_m / raw.geodesic_m.unwrap());
                    *levels
                        .entry((Level::of(raw.geodesic_m.unwrap()), episode.shape == Shape::Straight))
                        .or_insert(0) += 1;
                }
                Err(refusal) => *refused.entry(refusal.reason()).or_insert(0) += 1,
            }
        }
        ratios.sort_by(f64::total_cmp);
        let (share, median) = (ratios.len() as f64 / raws.len() as f64, ratios[ratios.len() / 2]);
        let tenth = |k: usize| ratios[k * (ratios.len() - 1) / 10];
        eprintln!("{name}: {} of {} placed, refused {refused:?}", ratios.len(), raws.len());
        eprintln!(
            "  ratio median {median:.4}, deciles {:.3} and {:.3}, all {:.3} to {:.3}",
            tenth(1),
            tenth(9),
            tenth(0),
            tenth(10)
        );
        assert!(share >= 0.95, "{name}: {share}");
        assert!((0.98..=1.03).contains(&median), "{name}: {median}");
    }
}
