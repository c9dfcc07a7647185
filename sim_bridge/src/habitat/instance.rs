//! InstanceImageNav v3 (Krantz et al. 2022): photos of objects, taken by cameras of their own, and places to stop at.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Map, Value};

use super::raw::{EpisodeId, RawCamera, RawGoal};

/// Success is stopping within this of a view point, metres (its published configuration).
pub(super) const SUCCESS_M: f64 = 0.1;

/// Which photo of which object an episode wants.
#[derive(Deserialize)]
pub(super) struct Wanted {
    goal_object_id: Option<EpisodeId>,
    goal_image_id: Option<usize>,
    object_category: Option<String>,
}

/// One object with its photos.
#[derive(Deserialize)]
pub(super) struct Instance {
    object_id: Option<EpisodeId>,
    image_goals: Vec<ImageGoal>,
    view_points: Vec<ViewPoint>,
}

#[derive(Deserialize)]
struct ImageGoal {
    position: [f64; 3],
    rotation: [f64; 4],
    hfov: f64,
    /// Rows, columns.
    image_dimensions: [u32; 2],
}

#[derive(Deserialize)]
struct ViewPoint {
    agent_state: AgentState,
}

#[derive(Deserialize)]
struct AgentState {
    position: [f64; 3],
}

/// Reads all objects, or says which is not one of v3.
pub(super) fn read_all(goals: Map<String, Value>) -> Result<BTreeMap<String, Instance>, String> {
    let one = |(key, value)| match serde_json::from_value(value) {
        Ok(instance) => Ok((key, instance)),
        Err(e) => Err(format!("its goal {key} is none of version 3: {e}")),
    };
    goals.into_iter().map(one).collect()
}

impl Wanted {
    /// The photo that an episode wants, and where to stop.
    pub fn goal(
        &self,
        scene_id: &str,
        instances: &BTreeMap<String, Instance>,
    ) -> Result<(RawGoal, Vec<[f64; 3]>), String> {
        let (Some(object), Some(image)) = (&self.goal_object_id, self.goal_image_id) else {
            return Err("it has neither goals nor goal_object_id and goal_image_id".into());
        };
        let scene = super::scenes::stem(scene_id);
        let mut keys = vec![format!("{scene}_{object}")];
        keys.extend(self.object_category.iter().map(|category| format!("{scene}_{category}_{object}")));
        let named = keys.iter().find_map(|key| instances.get(key));
        let of_scene = |key: &String| key.starts_with(&format!("{scene}_"));
        let alike =
            || instances.iter().find(|(k, i)| of_scene(k) && i.object_id.as_ref() == Some(object)).map(|(_, i)| i);
        let instance = named.or_else(alike).ok_or_else(|| format!("the file has no goal {}", keys.join(" or ")))?;
        let found = instance.image_goals.get(image);
        let photo =
            found.ok_or_else(|| format!("goal {} has {} photos, no {image}", keys[0], instance.image_goals.len()))?;
        let [height, width] = photo.image_dimensions;
        let camera = RawCamera { width, height, hfov_deg: photo.hfov };
        let goal = RawGoal { position: photo.position, rotation: Some(photo.rotation), camera: Some(camera) };
        if instance.view_points.is_empty() {
            return Err(format!("goal {} has no view points", keys[0]));
        }
        Ok((goal, instance.view_points.iter().map(|v| v.agent_state.position).collect()))
    }
}
