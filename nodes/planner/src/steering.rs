//! Where two headings are about equally good, each turn can make the other look better: with noisy odometry a body would
//! turn left and right on the spot without end. After two changes of mind it goes on ahead, or keeps to one side.

use crate::local::LocalChoice;

/// Changes of mind on the spot after which it is made up.
const CHANGES_MAX: u32 = 2;

/// Remembers the turns since the last step forward.
#[derive(Clone, Debug, Default)]
pub struct Steering {
    step: u64,
    side: Option<LocalChoice>,
    n_changes: u32,
}

/// Whether a step ahead touches anything.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Ahead {
    /// It does not.
    Clear,
    /// It would.
    Blocked,
}

impl Steering {
    /// The choice to act on at `step`, for the one that was made.
    pub fn settle(&mut self, step: u64, choice: LocalChoice, ahead: Ahead) -> LocalChoice {
        if step != self.step + 1 {
            (self.side, self.n_changes) = (None, 0);
        }
        self.step = step;
        if !matches!(choice, LocalChoice::Left | LocalChoice::Right) {
            (self.side, self.n_changes) = (None, 0);
            return choice;
        }
        let side = self.side.unwrap_or(choice);
        if side == choice {
            self.side = Some(choice);
            return choice;
        }
        self.n_changes += 1;
        if self.n_changes < CHANGES_MAX {
            self.side = Some(choice);
            return choice;
        }
        match ahead {
            Ahead::Clear => {
                (self.side, self.n_changes) = (None, 0);
                LocalChoice::Forward
            }
            // From now on it turns one way only, until a step forward is chosen.
            Ahead::Blocked => side,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use LocalChoice::{Forward, Left, Right};

    fn settled(choices: &[LocalChoice], ahead: Ahead) -> Vec<LocalChoice> {
        let mut steering = Steering::default();
        choices.iter().zip(1..).map(|(choice, step)| steering.settle(step, *choice, ahead)).collect()
    }

    #[test]
    fn who_changes_their_mind_twice_goes_ahead() {
        assert_eq!(settled(&[Left, Right, Left, Right], Ahead::Clear), [Left, Right, Forward, Right]);
    }

    #[test]
    fn who_cannot_go_ahead_keeps_to_a_side() {
        let all = settled(&[Left, Right, Left, Right, Left, Left, Forward, Left], Ahead::Blocked);
        assert_eq!(all, [Left, Right, Right, Right, Right, Right, Forward, Left]);
    }

    #[test]
    fn one_change_is_allowed_and_a_step_forward_settles_it() {
        assert_eq!(
            settled(&[Left, Left, Right, Forward, Left, Right], Ahead::Clear),
            [Left, Left, Right, Forward, Left, Right]
        );
        let mut steering = Steering::default();
        assert_eq!(steering.settle(1, Left, Ahead::Clear), Left);
        assert_eq!(steering.settle(2, Right, Ahead::Clear), Right);
        assert_eq!(steering.settle(9, Left, Ahead::Clear), Left, "other things were done in between");
    }
}
