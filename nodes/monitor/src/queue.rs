//! The bounded queue between a control loop and the recorder's thread.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::update::Update;

/// What an update is about. Each kind has its own share of the queue, so that a flood of one cannot push out another.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(usize)]
pub enum Kind {
    /// [`Update::Frame`]
    Frame,
    /// [`Update::Goal`]
    Goal,
    /// [`Update::Estimate`]
    Estimate,
    /// [`Update::Navigation`]
    Navigation,
    /// [`Update::Map`]
    Map,
    /// [`Update::Odometry`]
    Odometry,
    /// [`Update::Scan`]
    Scan,
    /// [`Update::TruthPose`]
    TruthPose,
    /// [`Update::TruthGoal`] and [`Update::ShortestPath`]
    Truth,
    /// [`Update::Latency`]
    Latency,
    /// [`Update::Log`]
    Log,
    /// [`Update::Verdict`]
    Verdict,
}

impl Kind {
    /// Every kind, in order.
    pub const ALL: [Kind; 12] = [
        Kind::Frame,
        Kind::Goal,
        Kind::Estimate,
        Kind::Navigation,
        Kind::Map,
        Kind::Odometry,
        Kind::Scan,
        Kind::TruthPose,
        Kind::Truth,
        Kind::Latency,
        Kind::Log,
        Kind::Verdict,
    ];

    /// How many may wait. Images are few because each holds megabytes; eight outlast a slow perception's answer.
    #[must_use]
    pub fn capacity(self) -> usize {
        match self {
            Kind::Map | Kind::Scan | Kind::Verdict => 2,
            Kind::Goal | Kind::Truth => 4,
            Kind::Frame => 8,
            Kind::Estimate => 16,
            Kind::Navigation | Kind::Odometry | Kind::TruthPose => 64,
            Kind::Latency | Kind::Log => 128,
        }
    }

    pub(crate) fn of(update: &Update) -> Self {
        match update {
            Update::Frame(_) => Kind::Frame,
            Update::Goal(_) => Kind::Goal,
            Update::Estimate(_) => Kind::Estimate,
            Update::Navigation(_) => Kind::Navigation,
            Update::Map(_) => Kind::Map,
            Update::Odometry(_) => Kind::Odometry,
            Update::Scan(_) => Kind::Scan,
            Update::TruthPose { .. } => Kind::TruthPose,
            Update::TruthGoal(_) | Update::ShortestPath(_) => Kind::Truth,
            Update::Latency { .. } => Kind::Latency,
            Update::Log { .. } => Kind::Log,
            Update::Verdict(_) => Kind::Verdict,
        }
    }
}

/// First in, first out, with a bound per [`Kind`]: a full kind loses its oldest update to the newest.
#[derive(Default)]
pub(crate) struct Queue {
    state: Mutex<State>,
    arrived: Condvar,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<(Kind, Update)>,
    counts: [usize; Kind::ALL.len()],
    dropped: [u64; Kind::ALL.len()],
    closed: bool,
    reader_sleeps: bool,
}

impl Queue {
    /// Adds an update. Holds the lock for a push and at most one removal; wakes the reader only if it sleeps.
    pub(crate) fn push(&self, update: Update) {
        let kind = Kind::of(&update);
        let mut state = self.lock();
        if state.closed {
            state.dropped[kind as usize] += 1;
            return;
        }
        let evicted = state.make_room(kind);
        state.counts[kind as usize] += 1;
        state.waiting.push_back((kind, update));
        let wake = std::mem::take(&mut state.reader_sleeps);
        drop(state);
        if wake {
            self.arrived.notify_one();
        }
        // Freed after the lock is released: an image takes longer to free than to queue.
        drop(evicted);
    }

    /// The oldest update; waits for one. `None` once the queue is closed and empty.
    pub(crate) fn pop(&self) -> Option<Update> {
        let mut state = self.lock();
        loop {
            if let Some((kind, update)) = state.waiting.pop_front() {
                state.counts[kind as usize] -= 1;
                return Some(update);
            }
            if state.closed {
                return None;
            }
            state.reader_sleeps = true;
            state = self.arrived.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// No more updates are taken; those that wait can still be read.
    pub(crate) fn close(&self) {
        self.lock().closed = true;
        self.arrived.notify_all();
    }

    /// Updates lost so far, by kind.
    pub(crate) fn dropped(&self) -> [u64; Kind::ALL.len()] {
        self.lock().dropped
    }

    // Nothing in here panics while the lock is held, so a poisoned state is a whole one.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn make_room(&mut self, kind: Kind) -> Option<(Kind, Update)> {
        if self.counts[kind as usize] < kind.capacity() {
            return None;
        }
        let oldest = self.waiting.iter().position(|(k, _)| *k == kind)?;
        self.counts[kind as usize] -= 1;
        self.dropped[kind as usize] += 1;
        self.waiting.remove(oldest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::update::Level;

    fn latency(ms: f64) -> Update {
        Update::Latency { name: "x".into(), ms }
    }

    fn log() -> Update {
        Update::Log { level: Level::Info, source: "t".into(), text: "x".into() }
    }

    #[test]
    fn a_full_kind_loses_its_oldest_and_leaves_the_others_alone() {
        let queue = Queue::default();
        queue.push(log());
        for i in 0..Kind::Latency.capacity() + 3 {
            queue.push(latency(i as f64));
        }
        queue.close();
        assert_eq!(queue.dropped()[Kind::Latency as usize], 3);
        assert_eq!(queue.dropped()[Kind::Log as usize], 0);
        assert!(matches!(queue.pop(), Some(Update::Log { .. })));
        assert!(matches!(queue.pop(), Some(Update::Latency { ms, .. }) if ms == 3.0));
        let rest = std::iter::from_fn(|| queue.pop()).count();
        assert_eq!(rest, Kind::Latency.capacity() - 1);
    }

    #[test]
    fn a_closed_queue_takes_nothing_and_counts_it() {
        let queue = Queue::default();
        queue.close();
        queue.push(log());
        assert!(queue.pop().is_none());
        assert_eq!(queue.dropped()[Kind::Log as usize], 1);
    }
}
