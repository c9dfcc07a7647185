//! Noise of a LoCoBot's odometry and wheels as Active Neural SLAM measured it (Chaplot et al., ICLR 2020): mixtures of
//! Gaussians for one step of 0.25 m and one turn of 10 degrees.
//!
//! Vectors of the mixtures are (metres, metres, degrees). The sensor's are errors with x ahead, y to the left and the
//! heading to the left, as REP-103 has it. The actuation's are whole motions with y to the RIGHT and the heading to the
//! right, in 0 to 360 degrees: a left turn's mean of 348.7 is a turn of 11.3 degrees to the left. What leaves this module
//! is in REP-103.

use homing_core::{PlanarPose, wrap_angle};
use rand_chacha::ChaCha8Rng;

use super::gmm::{Component, Mixture};

/// Length of the step that the mixtures are for, metres.
pub const STEP_M: f64 = 0.25;
/// Angle of the turn that the mixtures are for, radians (10 degrees).
pub const STEP_RAD: f64 = 10.0 * core::f64::consts::PI / 180.0;

/// The three motions that were measured.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Maneuver {
    /// A step of [`STEP_M`] ahead.
    Forward,
    /// A turn of [`STEP_RAD`] to the left.
    Left,
    /// A turn of [`STEP_RAD`] to the right.
    Right,
}

impl Maneuver {
    /// All three.
    pub const ALL: [Maneuver; 3] = [Maneuver::Forward, Maneuver::Left, Maneuver::Right];

    /// The motion that is meant.
    #[must_use]
    pub fn nominal(self) -> PlanarPose {
        match self {
            Maneuver::Forward => PlanarPose { x_m: STEP_M, y_m: 0.0, yaw_rad: 0.0 },
            Maneuver::Left => PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: STEP_RAD },
            Maneuver::Right => PlanarPose { x_m: 0.0, y_m: 0.0, yaw_rad: -STEP_RAD },
        }
    }
}

/// What a set of mixtures is of.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Quantity {
    Error,
    Motion,
}

/// One mixture for each motion.
#[derive(Clone, Debug, PartialEq)]
pub struct AnsMixtures {
    quantity: Quantity,
    mixtures: [Mixture; 3],
}

impl AnsMixtures {
    /// Errors of the odometry.
    #[must_use]
    pub fn sensor() -> Self {
        Self { quantity: Quantity::Error, mixtures: SENSOR.map(Mixture::unchecked) }
    }

    /// Motions that the wheels make of a command.
    #[must_use]
    pub fn actuation() -> Self {
        Self { quantity: Quantity::Motion, mixtures: ACTUATION.map(Mixture::unchecked) }
    }

    /// The mixture of a motion, in its own units and axes.
    #[must_use]
    pub fn mixture(&self, maneuver: Maneuver) -> &Mixture {
        &self.mixtures[maneuver as usize]
    }

    /// Draws an error in REP-103, metres and radians: of the odometry against the motion made, of the wheels against the
    /// motion meant.
    pub fn draw(&self, maneuver: Maneuver, rng: &mut ChaCha8Rng) -> PlanarPose {
        let [x, y, degrees] = self.mixture(maneuver).sample(rng);
        match self.quantity {
            Quantity::Error => PlanarPose { x_m: x, y_m: y, yaw_rad: degrees.to_radians() },
            Quantity::Motion => {
                let nominal = maneuver.nominal();
                let yaw_rad = wrap_angle(-degrees.to_radians() - nominal.yaw_rad);
                PlanarPose { x_m: x - nominal.x_m, y_m: -y - nominal.y_m, yaw_rad }
            }
        }
    }
}

const SENSOR: [&[Component]; 3] = [&SENSOR_FORWARD, &SENSOR_LEFT, &SENSOR_RIGHT];
const ACTUATION: [&[Component]; 3] = [&ACTUATION_FORWARD, &ACTUATION_LEFT, &ACTUATION_RIGHT];

const SENSOR_FORWARD: [Component; 2] = [
    Component {
        weight: 0.8448485951457255,
        mean: [0.0010070369199171407, -0.0010832973207667612, 6.203446615850594e-5],
        covariance: [
            [6.078466600143707e-6, -5.118928014789483e-7, 6.857333985411581e-7],
            [-5.118928014789483e-7, 5.220282859514777e-6, -1.7861465514544867e-6],
            [6.857333985411584e-7, -1.7861465514544867e-6, 4.832651988398432e-6],
        ],
    },
    Component {
        weight: 0.15515140485427473,
        mean: [0.0037773902513534414, 4.704612444922442e-5, -0.0005700517875854547],
        covariance: [
            [8.418687267264412e-6, -2.4263531763601713e-6, 6.157861938086188e-7],
            [-2.4263531763601717e-6, 4.94136199740073e-6, 5.342587459064795e-7],
            [6.15786193808619e-7, 5.342587459064794e-7, 5.587592794422145e-6],
        ],
    },
];
const SENSOR_LEFT: [Component; 1] = [Component {
    weight: 1.0,
    mean: [0.0020041023177330792, 0.019570691567066034, 0.19807911438897408],
    covariance: [
        [2.0687105109560304e-6, 5.299178989143249e-8, -8.407893021583574e-6],
        [5.299178989143249e-8, 2.4309991145818524e-6, -1.408025901329568e-5],
        [-8.407893021583574e-6, -1.408025901329568e-5, 0.006990780425236092],
    ],
}];
const SENSOR_RIGHT: [Component; 2] = [
    Component {
        weight: 0.5605190034297698,
        mean: [0.0016881104658370803, -0.01929068532369778, -0.039238980698546796],
        covariance: [
            [2.044885862238972e-6, -4.025979778937276e-7, -6.454214476128564e-6],
            [-4.025979778937275e-7, 2.6541580579747106e-6, 9.57619331937225e-6],
            [-6.454214476128566e-6, 9.576193319372252e-6, 0.004426288551431035],
        ],
    },
    Component {
        weight: 0.4394809965702302,
        mean: [0.0022873887300380435, -0.019516458349072865, 0.06772577898127595],
        covariance: [
            [2.234039536765853e-6, -8.998886894084859e-8, 1.1287583865996931e-5],
            [-8.998886894084858e-8, 1.8868334686756076e-6, 4.321163600090097e-6],
            [1.1287583865996931e-5, 4.321163600090098e-6, 0.003778270027358792],
        ],
    },
];
const ACTUATION_FORWARD: [Component; 2] = [
    Component {
        weight: 0.5795510054099255,
        mean: [0.24498558414059418, 0.0022122216383684105, 0.012458072906772085],
        covariance: [
            [1.3767664057770141e-5, -1.0901291030608682e-6, 3.672154715403317e-7],
            [-1.0901291030608684e-6, 6.707951914323328e-6, 6.514905788804959e-6],
            [3.672154715403316e-7, 6.5149057888049595e-6, 3.230260295688776e-5],
        ],
    },
    Component {
        weight: 0.42044899459007423,
        mean: [0.24651555042303414, 0.0018069480432607082, 0.004723272606661398],
        covariance: [
            [1.116315236110804e-5, 3.1073856280129763e-7, 5.938974124933055e-6],
            [3.1073856280129773e-7, 6.810112227485162e-6, 3.78660824642598e-6],
            [5.938974124933055e-6, 3.78660824642598e-6, 3.795414591212683e-5],
        ],
    },
];
const ACTUATION_LEFT: [Component; 2] = [
    Component {
        weight: 0.5685497090428805,
        mean: [-0.001516397072675203, -0.020057285520340494, 348.4838817865248],
        covariance: [
            [3.6654252079813437e-6, -4.136908351357285e-7, -7.04154556798548e-5],
            [-4.136908351357286e-7, 2.4048331805317414e-6, 0.0001587744879303604],
            [-7.04154556798548e-5, 0.0001587744879303604, 0.10487598233018185],
        ],
    },
    Component {
        weight: 0.4314502909571197,
        mean: [-0.001561785289377216, -0.019030398023909014, 349.0705974743749],
        covariance: [
            [4.514099469988504e-6, -2.5367373090727377e-7, 6.025861005903004e-5],
            [-2.5367373090727377e-7, 1.9402039688640927e-6, 8.813963102015978e-5],
            [6.025861005903005e-5, 8.81396310201598e-5, 0.06997902781489032],
        ],
    },
];
const ACTUATION_RIGHT: [Component; 1] = [Component {
    weight: 1.0,
    mean: [-0.000781959039211548, 0.01947121847925139, 11.08993010759542],
    covariance: [
        [5.2271115780764995e-6, -1.7065118563990197e-7, -8.559193635356526e-5],
        [-1.7065118563990197e-7, 2.3316589870764892e-6, 0.00032890132676095314],
        [-8.559193635356526e-5, 0.00032890132676095314, 0.23409985730700858],
    ],
}];

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use rand::SeedableRng;

    use super::super::gmm::Vector;
    use super::*;

    /// Means and standard deviations of the published mixtures, rounded to what is given: forward, left, right.
    const SENSOR_MEAN: [Vector; 3] =
        [[0.001437, -0.000908, -0.000036], [0.002004, 0.019571, 0.198079], [0.001952, -0.01939, 0.007769]];
    const SENSOR_SD: [Vector; 3] =
        [[0.00273, 0.00231, 0.00224], [0.00144, 0.00156, 0.0836], [0.00149, 0.00153, 0.0834]];
    const ACTUATION_MEAN: [Vector; 3] =
        [[0.245629, 0.002042, 0.009206], [-0.001536, -0.019614, 348.737], [-0.000782, 0.019471, 11.0899]];
    const ACTUATION_SD: [Vector; 3] =
        [[0.00364, 0.00261, 0.00702], [0.00201, 0.00157, 0.417], [0.00229, 0.00153, 0.484]];

    fn families() -> [(AnsMixtures, [Vector; 3], [Vector; 3]); 2] {
        [(AnsMixtures::sensor(), SENSOR_MEAN, SENSOR_SD), (AnsMixtures::actuation(), ACTUATION_MEAN, ACTUATION_SD)]
    }

    #[test]
    fn the_tables_are_mixtures() {
        for components in SENSOR.into_iter().chain(ACTUATION) {
            assert_eq!(Mixture::new(components).unwrap(), Mixture::unchecked(components));
        }
    }

    #[test]
    fn moments_of_the_tables_are_the_published_ones() {
        for (mixtures, means, deviations) in families() {
            for (i, maneuver) in Maneuver::ALL.into_iter().enumerate() {
                let (mean, sd) = (mixtures.mixture(maneuver).mean(), mixtures.mixture(maneuver).standard_deviation());
                for k in 0..3 {
                    let (m, s) = (means[i][k], deviations[i][k]);
                    assert!((mean[k] - m).abs() < 0.002 * s + 1e-6, "{maneuver:?}, axis {k}: mean {} for {m}", mean[k]);
                    assert!((sd[k] / s - 1.0).abs() < 0.005, "{maneuver:?}, axis {k}: deviation {} for {s}", sd[k]);
                }
            }
        }
    }

    #[test]
    fn moments_of_samples_are_the_published_ones() {
        const N: usize = 40_000;
        for (mixtures, means, deviations) in families() {
            for (i, maneuver) in Maneuver::ALL.into_iter().enumerate() {
                let rng = &mut ChaCha8Rng::seed_from_u64(11);
                let samples: Vec<Vector> = (0..N).map(|_| mixtures.mixture(maneuver).sample(rng)).collect();
                for k in 0..3 {
                    let n = N as f64;
                    let mean = samples.iter().map(|s| s[k]).sum::<f64>() / n;
                    let variance = samples.iter().map(|s| (s[k] - mean).powi(2)).sum::<f64>() / n;
                    let (m, s) = (means[i][k], deviations[i][k]);
                    // Four standard errors: s / sqrt(n), and s / sqrt(2 n) for the deviation.
                    assert!(
                        (mean - m).abs() < 4.0 * s / n.sqrt() + 1e-6,
                        "{maneuver:?}, axis {k}: mean {mean} for {m}"
                    );
                    let off = (variance.sqrt() / s - 1.0).abs();
                    assert!(off < 4.0 / (2.0 * n).sqrt() + 0.005, "{maneuver:?}, axis {k}: deviation off by {off}");
                }
            }
        }
    }

    #[test]
    fn a_left_turn_turns_left_and_slips_left() {
        let wheels = AnsMixtures::actuation();
        let rng = &mut ChaCha8Rng::seed_from_u64(2);
        for (maneuver, side) in [(Maneuver::Left, 1.0), (Maneuver::Right, -1.0)] {
            for _ in 0..200 {
                let error = wheels.draw(maneuver, rng);
                let turned_deg = (maneuver.nominal().yaw_rad + error.yaw_rad).to_degrees() * side;
                // 11.3 and 11.1 degrees on average, deviations below 0.5.
                assert!((9.0..13.5).contains(&turned_deg), "{maneuver:?} turned {turned_deg} to its side");
                // 2 cm to the side it turns to, deviation 1.6 mm.
                assert!((0.011..0.028).contains(&(error.y_m * side)), "{maneuver:?}: {error:?}");
            }
        }
        let mean_x_m = (0..2000).map(|_| wheels.draw(Maneuver::Forward, rng).x_m).sum::<f64>() / 2000.0;
        assert!((mean_x_m + 0.00437).abs() < 4.0 * 0.00364 / 2000.0_f64.sqrt(), "a step falls short by {mean_x_m}");
    }

    #[test]
    fn the_odometry_sees_turns_as_rep_103_does() {
        let sensor = AnsMixtures::sensor();
        let rng = &mut ChaCha8Rng::seed_from_u64(3);
        let mean_deg = (0..4000).map(|_| sensor.draw(Maneuver::Left, rng).yaw_rad.to_degrees()).sum::<f64>() / 4000.0;
        assert!((mean_deg - 0.198).abs() < 0.006, "a left turn is seen {mean_deg} degrees too far to the left");
        assert!(sensor.draw(Maneuver::Left, rng).y_m > 0.0 && sensor.draw(Maneuver::Right, rng).y_m < 0.0);
    }
}
