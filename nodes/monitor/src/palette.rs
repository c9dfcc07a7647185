//! One colour per meaning, the same in every view and in the picture.

/// Red, green, blue.
pub(crate) type Rgb = [u8; 3];

/// Colours on the viewer's dark ground.
pub(crate) mod dark {
    use super::Rgb;

    pub(crate) const GROUND: Rgb = [18, 21, 28];
    pub(crate) const UNKNOWN: Rgb = [30, 34, 43];
    pub(crate) const FREE: Rgb = [68, 76, 92];
    pub(crate) const OCCUPIED: Rgb = [226, 230, 238];
    pub(crate) const ESTIMATED: Rgb = [77, 163, 255];
    pub(crate) const TRUE: Rgb = [74, 222, 128];
    pub(crate) const SHORTEST: Rgb = [150, 158, 172];
    pub(crate) const PLANNED: Rgb = [255, 209, 102];
    pub(crate) const TARGET: Rgb = [255, 159, 28];
    pub(crate) const FRONTIER: Rgb = [190, 150, 255];
    pub(crate) const GOAL: Rgb = [255, 86, 146];
    pub(crate) const SCAN: Rgb = [255, 110, 90];
    pub(crate) const TEXT: Rgb = [222, 226, 234];
    pub(crate) const NEUTRAL: Rgb = [108, 117, 135];
}

/// Colours on the picture's white ground.
pub(crate) mod light {
    use super::Rgb;

    pub(crate) const GROUND: Rgb = [255, 255, 255];
    pub(crate) const PANEL: Rgb = [246, 247, 249];
    pub(crate) const UNKNOWN: Rgb = [236, 238, 242];
    pub(crate) const FREE: Rgb = [255, 255, 255];
    pub(crate) const OCCUPIED: Rgb = [58, 66, 82];
    pub(crate) const ESTIMATED: Rgb = [37, 110, 214];
    pub(crate) const TRUE: Rgb = [22, 150, 84];
    pub(crate) const SHORTEST: Rgb = [150, 156, 168];
    pub(crate) const GOAL: Rgb = [220, 38, 108];
    pub(crate) const START: Rgb = [71, 80, 98];
    pub(crate) const TEXT: Rgb = [28, 33, 43];
    pub(crate) const FAINT: Rgb = [112, 120, 136];
    pub(crate) const GOOD: Rgb = [22, 140, 78];
    pub(crate) const BAD: Rgb = [204, 48, 48];
}

/// A colour for a share from 0 to 1, from cold to warm at even brightness, so that neighbouring match lines differ.
pub(crate) fn ramp(share: f64) -> Rgb {
    const STOPS: [[f64; 3]; 5] =
        [[84.0, 160.0, 255.0], [60.0, 214.0, 200.0], [140.0, 226.0, 90.0], [255.0, 205.0, 70.0], [255.0, 120.0, 110.0]];
    let position = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (position as usize).min(STOPS.len() - 2);
    let t = position - below as f64;
    core::array::from_fn(|c| (STOPS[below][c] * (1.0 - t) + STOPS[below + 1][c] * t) as u8)
}
