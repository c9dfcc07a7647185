//! The ladder a goal hypothesis climbs as the robot comes nearer: confirmed, kept, or dropped and remembered as a lie.
//!
//! After the image-goal ladder of UniGoal and IEVE: over 100 matches confirm a goal from anywhere; on the way to it, within
//! 5 m, fewer than 80 drop it; within 2.5 m only more than 90 keep it. Here the numbers are shares of the switch's
//! threshold n_th, and they are held against the support of all views together, not against one: a view that shows less
//! takes support away, and only views that should have shown the goal count.

/// Where a hypothesis stands.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Enough speaks for it.
    Confirmed,
    /// Not enough, but nobody looked from where it should be seen.
    Kept,
    /// It should have been seen from here, and was not: it is wrong.
    Dropped,
}

/// The rungs.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct LadderConfig {
    /// Within this distance a goal that is driven to must keep its support, metres.
    pub approach_m: f64,
    /// Support needed there, as a share of n_th.
    pub approach_share: f64,
    /// Within this distance it must all but confirm itself, metres.
    pub near_m: f64,
    /// Support needed there, as a share of n_th.
    pub near_share: f64,
    /// Views in a row that should have shown it and did not, before it can be dropped on either rung.
    pub misses_min: u32,
    /// Within this distance a view that matches the photo's must show it, metres, ...
    pub there_m: f64,
    /// ... and within this difference of heading, radians.
    pub there_rad: f64,
    /// Such views in a row that did not, before it is dropped whatever its support.
    pub there_misses_max: u32,
}

impl Default for LadderConfig {
    fn default() -> Self {
        Self {
            approach_m: 5.0,
            approach_share: 0.8,
            near_m: 2.5,
            near_share: 0.9,
            misses_min: 4,
            there_m: 1.0,
            there_rad: 0.5,
            there_misses_max: 4,
        }
    }
}

/// What the ladder looks at.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Climb {
    /// From the robot to the hypothesis, metres.
    pub range_m: f64,
    /// What speaks for it, in matches.
    pub support: f64,
    /// The switch's n_th, in matches.
    pub n_th: f64,
    /// Views in a row that should have shown it and did not.
    pub n_missed: u32,
    /// Of these, such as are all but the photo's own.
    pub n_missed_there: u32,
}

impl LadderConfig {
    /// Whether a view from `range_m` away, turned by `turn_rad` from the goal's heading, is all but the photo's own.
    #[must_use]
    pub fn is_there(&self, range_m: f64, turn_rad: f64) -> bool {
        range_m <= self.there_m && turn_rad <= self.there_rad
    }

    /// Where a hypothesis stands after a view that did not show it.
    #[must_use]
    pub fn standing(&self, climb: &Climb) -> Standing {
        if climb.n_missed_there >= self.there_misses_max {
            return Standing::Dropped;
        }
        let share = match climb.range_m {
            near if near <= self.near_m => self.near_share,
            on_the_way if on_the_way <= self.approach_m => self.approach_share,
            _ => 0.0,
        };
        if climb.n_missed >= self.misses_min && climb.support < share * climb.n_th {
            Standing::Dropped
        } else if climb.support >= climb.n_th {
            Standing::Confirmed
        } else {
            Standing::Kept
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(range_m: f64, support: f64, n_missed: u32, n_missed_there: u32) -> Standing {
        LadderConfig::default().standing(&Climb { range_m, support, n_th: 100.0, n_missed, n_missed_there })
    }

    #[test]
    fn the_nearer_the_robot_comes_the_more_a_goal_must_show() {
        for range_m in [0.5, 2.0, 4.0, 8.0] {
            assert_eq!(standing(range_m, 101.0, 9, 0), Standing::Confirmed);
        }
        assert_eq!(standing(8.0, 10.0, 9, 0), Standing::Kept);
        assert_eq!(standing(4.0, 81.0, 9, 0), Standing::Kept);
        assert_eq!(standing(4.0, 79.0, 9, 0), Standing::Dropped);
        assert_eq!(standing(2.0, 85.0, 9, 0), Standing::Dropped);
        assert_eq!(standing(2.0, 91.0, 9, 0), Standing::Kept);
    }

    #[test]
    fn one_bad_view_drops_nothing_and_the_goals_own_view_decides() {
        assert_eq!(standing(2.0, 10.0, 3, 3), Standing::Kept);
        assert_eq!(standing(0.5, 500.0, 4, 4), Standing::Dropped);
    }
}
