//! Occupancy grid <-> nav_msgs/OccupancyGrid.

use homing_core::{Cell, Frame, GridGeometry, OccupancyGrid, Odom, Stamp};

use super::{Malformed, ToDomain, ToMessage, finite, header, time};
use crate::interfaces::nav_msgs;

const NAME: &str = "nav_msgs/OccupancyGrid";
const SIDE_MAX: u32 = 8192;

impl ToMessage<nav_msgs::OccupancyGrid> for (Stamp, &OccupancyGrid) {
    fn to_message(&self) -> nav_msgs::OccupancyGrid {
        let (at, grid) = *self;
        let g = &grid.geometry;
        let mut message = nav_msgs::OccupancyGrid { header: header(at, Odom::NAME), ..Default::default() };
        message.info.map_load_time = time(at);
        message.info.resolution = g.resolution_m as f32;
        message.info.width = u32::try_from(g.width).unwrap_or(u32::MAX);
        message.info.height = u32::try_from(g.height).unwrap_or(u32::MAX);
        message.info.origin.position.x = g.origin_x_m;
        message.info.origin.position.y = g.origin_y_m;
        message.info.origin.orientation.w = 1.0;
        message.data = grid
            .cells
            .iter()
            .map(|cell| match cell {
                Cell::Unknown => -1,
                Cell::Free => 0,
                Cell::Occupied => 100,
            })
            .collect();
        message
    }
}

impl ToDomain<OccupancyGrid> for nav_msgs::OccupancyGrid {
    fn to_domain(&self) -> Result<OccupancyGrid, Malformed> {
        let (width, height) = (self.info.width, self.info.height);
        let sides = 1..=SIDE_MAX;
        if !sides.contains(&width) || !sides.contains(&height) || self.data.len() != (width * height) as usize {
            return Err(Malformed::new(NAME, format!("{width}x{height} cells, {} values", self.data.len())));
        }
        let resolution_m = f64::from(self.info.resolution);
        if !(resolution_m > 0.0 && resolution_m.is_finite()) {
            return Err(Malformed::new(NAME, format!("resolution is {resolution_m} m")));
        }
        let q = &self.info.origin.orientation;
        if q.x != 0.0 || q.y != 0.0 || q.z != 0.0 {
            return Err(Malformed::new(NAME, "the map is turned; its axes must be those of its frame"));
        }
        let geometry = GridGeometry {
            width: width as usize,
            height: height as usize,
            resolution_m,
            origin_x_m: finite(self.info.origin.position.x, "origin.x", NAME)?,
            origin_y_m: finite(self.info.origin.position.y, "origin.y", NAME)?,
        };
        let cells = self
            .data
            .iter()
            .map(|value| match value {
                0..50 => Cell::Free,
                50..=100 => Cell::Occupied,
                _ => Cell::Unknown,
            })
            .collect();
        Ok(OccupancyGrid { geometry, cells })
    }
}
