//! A recording as a body: it shows, it does not move.

use homing_core::{
    Base, BridgeError, Camera, Capabilities, Motion, MotionOutcome, Observation, Odom, Odometry, RobotBridge, Transform,
};
use nalgebra::{Matrix3, Vector3};

use super::error::RecordingError;
use super::recording::{Recording, World};

/// Plays a recording frame by frame: each [`RobotBridge::observe`] shows the next.
///
/// Odometry is the recorded motion of the camera carried over to a base that the camera is thought to be mounted on,
/// starting at identity. A camera that was held by hand moves this base up, down and sideways too.
#[derive(Clone, Debug)]
pub struct ReplayBody {
    recording: Recording,
    capabilities: Capabilities,
    playlist: Vec<u32>,
    next: usize,
    t_base_world: Transform<Base, World>,
}

// The height the papers' agents carry their camera at, metres.
const CAMERA_HEIGHT_M: f64 = 1.25;

impl ReplayBody {
    /// All frames in order.
    ///
    /// # Errors
    /// [`RecordingError`] when the recording does not hold its own frames.
    pub fn new(recording: Recording) -> Result<Self, RecordingError> {
        let playlist = recording.numbers().collect();
        Self::with_playlist(recording, playlist)
    }

    /// These frames in this order; odometry begins at identity at the first of them. Images are read when shown.
    ///
    /// # Errors
    /// [`RecordingError::NoSuchFrame`] when one is not there, [`RecordingError::NoFrames`] for an empty list.
    pub fn with_playlist(recording: Recording, playlist: Vec<u32>) -> Result<Self, RecordingError> {
        for &number in &playlist {
            recording.t_world_camera(number)?;
        }
        let Some(&first) = playlist.first() else {
            return Err(RecordingError::NoFrames { directory: recording.directory().to_owned() });
        };
        let capabilities = capabilities(&recording);
        let t_base_world = capabilities.t_base_camera * recording.t_world_camera(first)?.inverse();
        Ok(Self { recording, capabilities, playlist, next: 0, t_base_world })
    }

    /// What is played.
    #[must_use]
    pub fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Number of the frame the next observation shows; `None` at the end.
    #[must_use]
    pub fn next_number(&self) -> Option<u32> {
        self.playlist.get(self.next).copied()
    }

    /// Pose of the base at a frame of the recording, odometry frame.
    ///
    /// # Errors
    /// [`RecordingError::NoSuchFrame`].
    pub fn t_odom_base(&self, number: u32) -> Result<Transform<Odom, Base>, RecordingError> {
        let t_world_camera = self.recording.t_world_camera(number)?;
        let t_start_base: Transform<Base, Base> =
            self.t_base_world * t_world_camera * self.capabilities.t_base_camera.inverse();
        // The odometry frame is where the base was at the first frame.
        Ok(Transform::new(*t_start_base.isometry()))
    }

    fn odometry(&self, index: usize) -> Result<Odometry, RecordingError> {
        let number = self.playlist[index];
        let t_odom_base = self.t_odom_base(number)?;
        let stamp = Recording::stamp(number);
        let mut odometry = Odometry { stamp, t_odom_base, linear_m_s: 0.0, angular_rad_s: 0.0 };
        if let Some(&before) = index.checked_sub(1).and_then(|i| self.playlist.get(i))
            && before < number
        {
            let moved = (self.t_odom_base(before)?.inverse() * t_odom_base).planar();
            let dt_s = stamp.since(Recording::stamp(before)).as_secs_f64();
            (odometry.linear_m_s, odometry.angular_rad_s) = (moved.x_m / dt_s, moved.yaw_rad / dt_s);
        }
        Ok(odometry)
    }

    fn device(&self, error: &RecordingError) -> BridgeError {
        BridgeError::Device { name: self.capabilities.name.clone(), what: error.to_string() }
    }
}

impl RobotBridge for ReplayBody {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Shows the next frame. One that cannot be read is reported once and passed over.
    fn observe(&mut self) -> Result<Observation, BridgeError> {
        let index = self.next;
        let Some(&number) = self.playlist.get(index) else {
            return Err(BridgeError::Exhausted { name: self.capabilities.name.clone() });
        };
        self.next += 1;
        let frame = self.recording.frame(number).map_err(|e| self.device(&e))?;
        let odometry = self.odometry(index).map_err(|e| self.device(&e))?;
        Ok(Observation { frame, odometry, scan: None })
    }

    fn apply(&mut self, motion: Motion) -> Result<MotionOutcome, BridgeError> {
        if !motion.is_finite() {
            return Err(BridgeError::NotFinite { motion });
        }
        Err(BridgeError::NotDrivable { name: self.capabilities.name.clone() })
    }

    fn stop(&mut self) {}
}

/// A camera that looks straight ahead from `height_m` metres above the base.
#[must_use]
pub fn level_camera(height_m: f64) -> Transform<Base, Camera> {
    // Columns: the camera's x (right), y (down) and z (forward) in the base's forward, left, up.
    let r_base_camera = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    Transform::from_rotation(&r_base_camera, Vector3::new(0.0, 0.0, height_m))
}

fn capabilities(recording: &Recording) -> Capabilities {
    let folder = recording.directory().file_name().map(|name| name.to_string_lossy().into_owned());
    Capabilities {
        name: format!("recording {}", folder.unwrap_or_default()),
        drivable: false,
        has_scan: false,
        intrinsics: recording.intrinsics(),
        t_base_camera: level_camera(CAMERA_HEIGHT_M),
        radius_m: 0.18,
        height_m: 1.5,
        linear_m_s_max: 0.5,
        angular_rad_s_max: 1.0,
    }
}
