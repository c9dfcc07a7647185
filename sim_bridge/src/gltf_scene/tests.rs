#![expect(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

use super::*;

/// A glTF with one triangle (0,0,0) (1,0,0) (0,0,-1) in a node raised by 2 m and scaled by 3.
fn triangle(extra: &str) -> String {
    // Nine floats: 0 0 0, 1 0 0, 0 0 -1.
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAAAAAIC/";
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"mesh": 0, "translation": [0, 2, 0], "scale": [3, 3, 3]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, -1], "max": [1, 0, 0]}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "buffers": [{{"byteLength": 36, "uri": "data:application/octet-stream;base64,{data}"}}] {extra}}}"#
    )
}

#[test]
fn axes_node_transforms_and_normals_come_out_in_the_world_frame() {
    let scene = load_bytes("triangle", triangle("").as_bytes()).unwrap();
    let vertices = &scene.meshes[0].vertices;
    assert_eq!(
        vertices.iter().map(|v| v.position).collect::<Vec<_>>(),
        [[0.0, -0.0, 2.0], [3.0, -0.0, 2.0], [0.0, 3.0, 2.0]]
    );
    assert!(vertices.iter().all(|v| v.normal == [0.0, 0.0, 1.0]));
    assert!(scene.materials.get(scene.meshes[0].material).is_some());
}

#[test]
fn what_is_no_scene_is_refused_with_the_reason() {
    let refused = |bytes: &[u8]| load_bytes("bad", bytes).unwrap_err();
    assert!(matches!(refused(b"not a scene"), SceneError::NotGltf { .. }));
    assert!(matches!(refused(b""), SceneError::NotGltf { .. }));
    assert!(matches!(refused(b"glTF\x02\0\0\0\xff\xff\0\0"), SceneError::Truncated { needed: 65535, found: 12, .. }));
    let short = triangle("").replace("\"count\": 3", "\"count\": 4000");
    assert!(matches!(refused(short.as_bytes()), SceneError::Truncated { needed: 48000, found: 36, .. }));
    let view = triangle("").replace("\"byteLength\": 36}]", "\"byteLength\": 3600}]");
    assert!(matches!(refused(view.as_bytes()), SceneError::Truncated { .. }));
    let giant = triangle("").replace("[3, 3, 3]", "[3e6, 3, 3]");
    assert!(matches!(refused(giant.as_bytes()), SceneError::TooLarge { what: "a coordinate", .. }));
    let empty = triangle("").replace("\"mesh\": 0, ", "");
    assert!(matches!(refused(empty.as_bytes()), SceneError::NoTriangles { .. }));
    let address = triangle("").replace("data:application/octet-stream;base64,", "https://example.org/");
    assert!(matches!(refused(address.as_bytes()), SceneError::Address { .. }));
    let texture = triangle(r#", "images": [{"uri": "data:image/png;base64,AAAA"}]"#);
    assert!(matches!(refused(texture.as_bytes()), SceneError::Texture { index: 0, .. }));
    let missing = load(Path::new("no/such/scene.glb")).unwrap_err();
    assert!(missing.to_string().contains("no/such/scene.glb"), "{missing}");
}

#[test]
fn the_small_house_is_a_furnished_flat() {
    let folder = std::env::var_os("HOMING_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = folder.join("scenes/small_house.glb");
    if !path.exists() {
        eprintln!("SKIPPED the_small_house_is_a_furnished_flat: no {} (set HOMING_DATA)", path.display());
        return;
    }
    let scene = load(&path).unwrap();
    assert_eq!(scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>(), 145_844);
    assert_eq!(scene.textures.len(), 42);
    assert!(scene.textures.iter().all(|t| t.width.is_power_of_two() && t.height.is_power_of_two()));
    let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
    for vertex in scene.meshes.iter().flat_map(|m| &m.vertices) {
        for k in 0..3 {
            low[k] = low[k].min(vertex.position[k]);
            high[k] = high[k].max(vertex.position[k]);
        }
    }
    assert!((high[0] - low[0] - 19.0).abs() < 1.0 && (high[1] - low[1] - 11.4).abs() < 1.0, "{low:?} {high:?}");
    assert!(low[2].abs() < 0.2, "floor at {}", low[2]);
    let cut = std::fs::read(&path).unwrap();
    let error = load_bytes("cut", &cut[..cut.len() / 2]).unwrap_err();
    let SceneError::Truncated { .. } = error else { panic!("{error}") };
}
