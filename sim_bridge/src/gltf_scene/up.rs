//! Scenes that stand on their side: scans published for Habitat (Gibson, Matterport3D, HM3D) are z up against the standard.

use std::path::Path;

use serde::Deserialize;

use super::SceneError;
use crate::scene::Scene;

/// What `NAME.toml` beside `NAME.glb` may say.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Description {
    up: Up,
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Up {
    /// As glTF has it.
    #[default]
    Y,
    /// As the scans have it.
    Z,
}

impl Up {
    /// The axis stated beside a scene file, y if there is no statement.
    pub fn beside(path: &Path) -> Result<Self, SceneError> {
        let path = path.with_extension("toml");
        match std::fs::read_to_string(&path) {
            Ok(text) => match toml::from_str::<Description>(&text) {
                Ok(description) => Ok(description.up),
                Err(e) => Err(SceneError::Description { path, what: e.to_string() }),
            },
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(Self::Y),
            Err(source) => Err(SceneError::Read { path, source }),
        }
    }

    /// Turns a scene that was read as y up. What was z up ends with the file's own axes, as its episodes expect: Habitat
    /// takes (x, y, z) of such a file for (x, z, -y), and we take that for (x, y, z).
    pub fn apply(self, scene: &mut Scene) {
        if self == Self::Y {
            return;
        }
        for vertex in scene.meshes.iter_mut().flat_map(|m| &mut m.vertices) {
            let turned = |[x, y, z]: [f32; 3]| [x, z, -y];
            (vertex.position, vertex.normal) = (turned(vertex.position), turned(vertex.normal));
        }
    }
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Vertex};

    #[test]
    fn the_file_beside_a_scene_says_what_is_up() {
        let folder = std::env::temp_dir().join(format!("homing-up-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let scene = folder.join("Scan.glb");
        assert_eq!(Up::beside(&scene).unwrap(), Up::Y);
        std::fs::write(folder.join("Scan.toml"), "up = \"z\"").unwrap();
        assert_eq!(Up::beside(&scene).unwrap(), Up::Z);
        std::fs::write(folder.join("Scan.toml"), "up = \"x\"").unwrap();
        assert!(Up::beside(&scene).unwrap_err().to_string().contains("Scan.toml"));
    }

    #[test]
    fn a_scan_s_own_axes_are_kept() {
        // The file's (1, 2, 3), read as y up, is (1, -3, 2).
        let vertex = Vertex { position: [1.0, -3.0, 2.0], normal: [0.0, -1.0, 0.0], uv: [0.0; 2] };
        let mut scene = Scene { meshes: vec![Mesh { vertices: vec![vertex], ..Mesh::default() }], ..Scene::default() };
        Up::Y.apply(&mut scene);
        assert_eq!(scene.meshes[0].vertices[0], vertex);
        Up::Z.apply(&mut scene);
        assert_eq!(scene.meshes[0].vertices[0].position, [1.0, 2.0, 3.0]);
        assert_eq!(scene.meshes[0].vertices[0].normal, [0.0, 0.0, 1.0]);
    }
}
