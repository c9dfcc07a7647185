//! Matchers: one file per contract.

pub(super) mod glue;
pub mod homing;
pub mod lighterglue;
pub mod lightglue;

use self::glue::GlueMatcher;
use super::AnyMatcher;
use super::contract::Contract;
use super::extractors::ExtractorContract;
use super::network::Network;

/// Contracts of matchers.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum MatcherContract {
    /// Our own.
    Homing,
    /// LighterGlue, XFeat's matcher.
    LighterGlue,
    /// LightGlue (Lindenberger, Sarlin, Pollefeys, ICCV 2023).
    LightGlue,
}

/// What a matcher may keep, and how much it is given.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MatcherConfig {
    /// Most keypoints of either image that are matched, strongest first: attention costs their square.
    pub keypoints_max: usize,
    /// Smallest confidence of a match.
    pub confidence_min: f32,
}

impl Default for MatcherConfig {
    fn default() -> Self {
        Self { keypoints_max: 1024, confidence_min: 0.1 }
    }
}

impl MatcherContract {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Homing, Self::LighterGlue, Self::LightGlue];

    /// The contract as data.
    #[must_use]
    pub fn contract(self) -> &'static Contract {
        match self {
            Self::Homing => &homing::CONTRACT,
            Self::LighterGlue => &lighterglue::CONTRACT,
            Self::LightGlue => &lightglue::CONTRACT,
        }
    }

    /// The contract of that name; where only a matcher can be meant, "homing" is ours.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let named = Self::ALL.into_iter().find(|c| c.contract().name == name);
        named.or_else(|| (name == ExtractorContract::Homing.contract().name).then_some(Self::Homing))
    }

    /// Extractors whose descriptors such a matcher was trained on.
    #[must_use]
    pub fn takes(self) -> &'static [ExtractorContract] {
        match self {
            Self::Homing => &[ExtractorContract::Homing],
            Self::LighterGlue => &[ExtractorContract::Xfeat],
            Self::LightGlue => &[ExtractorContract::Superpoint, ExtractorContract::Aliked],
        }
    }

    /// A matcher around a network that fulfils this contract.
    #[must_use]
    pub fn matcher(self, network: Box<dyn Network>, config: MatcherConfig) -> AnyMatcher {
        let form = match self {
            Self::Homing => homing::FORM,
            Self::LighterGlue => lighterglue::FORM,
            Self::LightGlue => lightglue::FORM,
        };
        Box::new(GlueMatcher::new(network, form, config))
    }
}
