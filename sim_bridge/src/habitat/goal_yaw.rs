//! Where the goal photo of an ImageNav episode looks whose file does not say.
//!
//! Habitat's ImageGoalSensor draws the angle about its y axis as
//! `numpy.random.RandomState(abs(hash(episode_id)) % 2**32).uniform(0, 2 * pi)`. Python's hash of a number is a number that
//! everybody gets; that of a text depends on PYTHONHASHSEED, for which 0 is taken here: the only value for which
//! published figures can be had again.

use core::f64::consts::TAU;
use core::hash::Hasher;

use siphasher::sip::SipHasher13;

use super::raw::EpisodeId;

/// The modulus of Python's hash of whole numbers.
const PYTHON_MODULUS: u64 = (1 << 61) - 1;

/// The goal's angle about Habitat's y axis, radians, 0 to 2 pi.
#[must_use]
pub fn goal_angle_rad(id: &EpisodeId) -> f64 {
    Mt19937::new(python_hash(id).unsigned_abs() as u32).unit() * TAU
}

/// CPython's hash (3.11 and later, PYTHONHASHSEED=0).
fn python_hash(id: &EpisodeId) -> i64 {
    let hash = match id {
        EpisodeId::Number(n) => (n.unsigned_abs() % PYTHON_MODULUS) as i64 * n.signum(),
        EpisodeId::Text(text) if text.is_empty() => 0,
        EpisodeId::Text(text) => {
            let mut hasher = SipHasher13::new_with_keys(0, 0);
            hasher.write(&python_memory(text));
            hasher.finish().cast_signed()
        }
    };
    if hash == -1 { -2 } else { hash }
}

/// The characters as CPython keeps them (PEP 393): one, two or four bytes each, as the largest needs.
fn python_memory(text: &str) -> Vec<u8> {
    match text.chars().map(u32::from).max().unwrap_or(0) {
        0..=0xff => text.chars().map(|c| u32::from(c) as u8).collect(),
        0x100..=0xffff => text.chars().flat_map(|c| (u32::from(c) as u16).to_le_bytes()).collect(),
        _ => text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect(),
    }
}

/// Length of the generator's state.
const N: usize = 624;

/// The Mersenne twister (Matsumoto and Nishimura 1998), seeded as numpy's RandomState is by a number.
struct Mt19937 {
    state: [u32; N],
    next: usize,
}

impl Mt19937 {
    fn new(seed: u32) -> Self {
        let mut state = [seed; N];
        for k in 1..N {
            let before = state[k - 1] ^ (state[k - 1] >> 30);
            state[k] = before.wrapping_mul(1_812_433_253).wrapping_add(k as u32);
        }
        Self { state, next: N }
    }

    fn twist(&mut self) {
        for k in 0..N {
            let joined = (self.state[k] & 0x8000_0000) | (self.state[(k + 1) % N] & 0x7fff_ffff);
            let odd = if joined & 1 == 1 { 0x9908_b0df } else { 0 };
            self.state[k] = self.state[(k + 397) % N] ^ (joined >> 1) ^ odd;
        }
        self.next = 0;
    }

    fn word(&mut self) -> u32 {
        if self.next >= N {
            self.twist();
        }
        let mut y = self.state[self.next];
        self.next += 1;
        y ^= y >> 11;
        y ^= (y << 7) & 0x9d2c_5680;
        y ^= (y << 15) & 0xefc6_0000;
        y ^ (y >> 18)
    }

    /// 0 to 1 with 53 bits.
    fn unit(&mut self) -> f64 {
        let (high, low) = (self.word() >> 5, self.word() >> 6);
        (f64::from(high) * 67_108_864.0 + f64::from(low)) / 9_007_199_254_740_992.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angles_are_numpy_s() {
        // numpy.random.RandomState(s).uniform(0, 2 * pi), numpy 2.4.6.
        let known = [(0, 3.448296944257913), (2, 2.7394367631438397), (5489, 5.119059895756811)];
        for (id, angle) in known {
            assert_eq!(goal_angle_rad(&EpisodeId::Number(id)), angle);
        }
        assert_eq!(goal_angle_rad(&EpisodeId::Number((1 << 32) - 1)), 0.6134401300853188);
    }

    #[test]
    fn the_hashes_are_python_s() {
        // hash(..) by CPython 3.11 with PYTHONHASHSEED=0.
        let known = [
            ("a", 4_644_417_185_603_328_019),
            ("X_12", 6_466_919_482_532_865_383),
            ("\u{e9}1", -2_688_345_669_257_662_417),
            ("\u{6f22}", -6_576_571_924_611_027_090),
            ("\u{1f600}", -3_536_540_696_076_613_844),
            ("", 0),
        ];
        for (text, hash) in known {
            assert_eq!(python_hash(&EpisodeId::Text(text.into())), hash, "{text}");
        }
        for (n, hash) in [(-1, -2), (-5, -5), ((1 << 61) - 1, 0), ((1 << 61) + 3, 4)] {
            assert_eq!(python_hash(&EpisodeId::Number(n)), hash, "{n}");
        }
        assert_eq!(goal_angle_rad(&EpisodeId::Text("X_12".into())), 3.7631165702584943);
    }
}
