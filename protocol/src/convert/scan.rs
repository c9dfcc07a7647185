//! Laser scan <-> sensor_msgs/LaserScan.

use homing_core::{Base, Frame, LaserScan};

use super::{Malformed, ToDomain, ToMessage, finite, header, stamp};
use crate::interfaces::sensor_msgs;

const NAME: &str = "sensor_msgs/LaserScan";
const RAYS_MAX: usize = 32_768;

impl ToMessage<sensor_msgs::LaserScan> for LaserScan {
    fn to_message(&self) -> sensor_msgs::LaserScan {
        let rays = self.ranges_m.len().saturating_sub(1) as f64;
        sensor_msgs::LaserScan {
            header: header(self.stamp, Base::NAME),
            angle_min: self.angle_min_rad as f32,
            angle_max: (self.angle_min_rad + rays * self.angle_increment_rad) as f32,
            angle_increment: self.angle_increment_rad as f32,
            range_min: self.range_min_m as f32,
            range_max: self.range_max_m as f32,
            ranges: self.ranges_m.clone(),
            ..Default::default()
        }
    }
}

impl ToDomain<LaserScan> for sensor_msgs::LaserScan {
    fn to_domain(&self) -> Result<LaserScan, Malformed> {
        if self.ranges.len() > RAYS_MAX {
            return Err(Malformed::new(NAME, format!("{} rays, {RAYS_MAX} are allowed", self.ranges.len())));
        }
        let number = |value: f32, field| finite(f64::from(value), field, NAME);
        Ok(LaserScan {
            stamp: stamp(&self.header.stamp, NAME)?,
            angle_min_rad: number(self.angle_min, "angle_min")?,
            angle_increment_rad: number(self.angle_increment, "angle_increment")?,
            range_min_m: number(self.range_min, "range_min")?,
            range_max_m: number(self.range_max, "range_max")?,
            // NaN means "no measurement" in ROS; a robot must not take it for free space, so it becomes zero range.
            ranges_m: self.ranges.iter().map(|r| if r.is_nan() { 0.0 } else { *r }).collect(),
        })
    }
}
