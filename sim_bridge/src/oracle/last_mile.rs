//! Oracle-LM-Pose and Oracle-LP: the last mile with a perfect displacement, and with a perfect local policy (SLING 4.2).

use homing_core::{Base, Camera, GoalEstimate, PlanarPose, Sighting, Transform};
use nalgebra::Matrix6;

use super::in_world;
use crate::arena::Arena;
use crate::episode::Episode;
use crate::geodesic::GeodesicField;
use crate::scene::World;

/// Matches that a perfect estimate claims: more than any switch asks for.
const N_INLIERS: usize = 300;
/// Variance of a perfect estimate, m^2 and rad^2: 1 mm and 1 mrad.
const VARIANCE: f64 = 1e-6;
/// A landing place is looked for this far around a prediction, metres.
const LANDING_M: f64 = 1.0;

/// Oracle-LM-Pose: wherever perception finds a goal at all, its finding becomes the true displacement. Whether it finds one
/// stays perception's own doing. `pose_odom` is the base where the estimate's image was taken.
#[must_use]
pub fn perfect(
    mut estimate: GoalEstimate,
    episode: &Episode,
    pose_odom: &PlanarPose,
    t_base_camera: &Transform<Base, Camera>,
) -> GoalEstimate {
    if matches!(estimate.sighting, Sighting::NotSeen { .. }) {
        return estimate;
    }
    let (t_world_base, t_world_goal): (Transform<World, Base>, Transform<World, Base>) =
        (in_world(episode, pose_odom).to_transform(), PlanarPose::from(episode.goal).to_transform());
    let camera = t_base_camera.isometry();
    let t_camera_goal = camera.inverse() * t_world_base.isometry().inverse() * t_world_goal.isometry() * camera;
    estimate.sighting = Sighting::Pose {
        t_camera_goal: Transform::new(t_camera_goal),
        covariance: Matrix6::identity() * VARIANCE,
        n_inliers: N_INLIERS,
        rms_rad: 0.0,
    };
    estimate
}

/// Oracle-LP: where a robot lands that is teleported to a predicted goal, world frame: there, or at the nearest free place
/// within a metre; `None` if there is none. The way to it is that of the shortest path, metres.
#[must_use]
pub fn landing(arena: &Arena, from: PlanarPose, prediction: PlanarPose) -> Option<(PlanarPose, f64)> {
    let space = arena.space();
    let (x_m, y_m) = space.nearest(prediction.x_m, prediction.y_m, LANDING_M)?;
    let way_m = GeodesicField::to(space, (x_m, y_m)).ok()?.distance_m(from.x_m, from.y_m)?;
    Some((PlanarPose { x_m, y_m, yaw_rad: prediction.yaw_rad }, way_m))
}

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use homing_core::{StageTimes, Stamp, UnseenReason};

    use super::*;
    use crate::arena::{BodySize, SceneRef};
    use crate::episode::{EpisodeSpec, FloorPose, Viewpoint, draw};
    use crate::flat::Detail;

    fn estimate(sighting: Sighting) -> GoalEstimate {
        GoalEstimate {
            stamp: Stamp(0),
            goal_id: 1,
            sighting,
            n_matches: 40,
            switch_probability: None,
            matched_points: Vec::new(),
            times: StageTimes::default(),
        }
    }

    #[test]
    fn a_finding_becomes_the_truth_and_nothing_found_stays_so() {
        let mount = Viewpoint::default().t_base_camera();
        let north = core::f64::consts::FRAC_PI_2;
        let episode = Episode {
            start: FloorPose { x_m: 1.0, y_m: 1.0, yaw_rad: north },
            goal: FloorPose { x_m: 1.0, y_m: 5.0, yaw_rad: north },
            ..an_episode()
        };
        // A metre ahead of the start.
        let pose = PlanarPose { x_m: 1.0, y_m: 0.0, yaw_rad: 0.0 };
        let found = Sighting::Bearing { bearing_rad: 1.0, bearing_sd_rad: 0.1, heading_rad: 0.0, n_inliers: 9 };
        let Sighting::Pose { t_camera_goal, .. } = perfect(estimate(found), &episode, &pose, &mount).sighting else {
            unreachable!("a pose")
        };
        // Three metres straight ahead of a camera that looks the same way.
        let p = t_camera_goal.translation();
        assert!(p.x.abs() < 1e-9 && p.y.abs() < 1e-9 && (p.z - 3.0).abs() < 1e-9, "{p}");
        let unseen = Sighting::NotSeen { reason: UnseenReason::TooFewMatches };
        assert_eq!(perfect(estimate(unseen.clone()), &episode, &pose, &mount).sighting, unseen);
    }

    fn an_episode() -> Episode {
        let arena = Arena::load_as(&SceneRef::Flat { seed: 5 }, BodySize::default(), Detail::Shape).unwrap();
        draw(&arena, 5, &EpisodeSpec::default()).unwrap()
    }

    #[test]
    fn a_prediction_inside_furniture_lands_beside_it() {
        let arena = Arena::load_as(&SceneRef::Flat { seed: 5 }, BodySize::default(), Detail::Shape).unwrap();
        let from = arena.space().nth(100).map(|(x_m, y_m)| PlanarPose { x_m, y_m, yaw_rad: 0.0 }).unwrap();
        let (there, way_m) = landing(&arena, from, PlanarPose { x_m: from.x_m + 0.5, ..from }).unwrap();
        assert!(arena.space().contains(there.x_m, there.y_m) && way_m < 3.0, "{there:?} {way_m}");
        assert_eq!(landing(&arena, from, PlanarPose { x_m: -50.0, y_m: -50.0, yaw_rad: 0.0 }), None);
    }
}
