//! Runs configurations over all pairs of a source.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use serde::Serialize;

use super::findings::Finding;
use super::pairs::{PairFacts, PairSource};
use super::workbench::{Setup, Workbench};
use crate::RunError;

/// All pairs, and what each configuration found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measured {
    /// The pairs.
    pub pairs: Vec<PairFacts>,
    /// Per configuration one finding for each pair.
    pub findings: Vec<Vec<Finding>>,
}

/// How much to measure.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct MeasureOptions {
    /// Units side by side; 0 for one per core. Models and OpenCV get one thread in each.
    pub threads: usize,
    /// End with the unit that completes so many pairs with or without the goal in view; `None` measures all.
    pub n_decided: Option<usize>,
}

/// Measures every configuration on the units of a source, in their order, until there are enough pairs. `progress` hears how
/// many pairs, with the goal in view or without, each unit added, in any order. The result is the same whatever the number
/// of threads.
///
/// # Errors
/// [`RunError`] of the first unit that failed, or of a configuration that cannot be opened.
pub fn measure(
    source: &dyn PairSource,
    setups: &[Setup],
    options: &MeasureOptions,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Measured, RunError> {
    let n_threads = match options.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let ledger = Mutex::new(Ledger::new(options.n_decided));
    let (next, enough) = (AtomicUsize::new(0), AtomicBool::new(false));
    let worker = || -> Result<(), RunError> {
        // A pool of its own keeps the renderer's work on this thread: see `bench`.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
        let mut bench = Workbench::open(setups, 1)?;
        while !enough.load(Ordering::Relaxed) {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= source.n_units() {
                break;
            }
            let result = pool.install(|| source.unit(i).and_then(|unit| bench.measure(&unit)));
            let n_decided = result.as_ref().map_or(0, Measured::n_decided);
            progress(n_decided);
            let mut ledger = ledger.lock().unwrap_or_else(PoisonError::into_inner);
            enough.fetch_or(ledger.enter(i, result, n_decided), Ordering::Relaxed);
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..n_threads.min(source.n_units().max(1))).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    ledger.into_inner().unwrap_or_else(PoisonError::into_inner).close(setups.len())
}

impl Measured {
    /// Pairs of which it is plain whether the goal is in view.
    #[must_use]
    pub fn n_decided(&self) -> usize {
        self.pairs.iter().filter(|p| p.goal_in_view().is_some()).count()
    }
}

/// Results of units as they arrive; those in order from the first on count.
struct Ledger {
    wanted: usize,
    waiting: BTreeMap<usize, (Result<Measured, RunError>, usize)>,
    in_order: Vec<Result<Measured, RunError>>,
    n_decided: usize,
}

impl Ledger {
    fn new(wanted: Option<usize>) -> Self {
        let wanted = wanted.unwrap_or(usize::MAX);
        Self { wanted, waiting: BTreeMap::new(), in_order: Vec::new(), n_decided: 0 }
    }

    /// Takes in one unit; true once nothing more is needed.
    fn enter(&mut self, i: usize, result: Result<Measured, RunError>, n_decided: usize) -> bool {
        let failed = result.is_err();
        self.waiting.insert(i, (result, n_decided));
        while self.n_decided < self.wanted
            && let Some((result, n)) = self.waiting.remove(&self.in_order.len())
        {
            self.n_decided += n;
            self.in_order.push(result);
        }
        failed || self.n_decided >= self.wanted
    }

    fn close(self, n_setups: usize) -> Result<Measured, RunError> {
        // A unit that failed out of turn ended the run, too.
        let late = if self.n_decided < self.wanted { self.waiting.into_values().collect() } else { Vec::new() };
        let mut all = Measured { pairs: Vec::new(), findings: vec![Vec::new(); n_setups] };
        for result in self.in_order.into_iter().chain(late.into_iter().map(|(result, _)| result)) {
            let unit = result?;
            all.pairs.extend(unit.pairs);
            all.findings.iter_mut().zip(unit.findings).for_each(|(into, findings)| into.extend(findings));
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::unwrap_used, reason = "a test may fail by panicking")]

    use super::super::pairs::PairKind;
    use super::*;

    /// One pair whose cluster tells the unit.
    fn unit(cluster: u64) -> Measured {
        let facts = PairFacts {
            kind: PairKind::Elsewhere,
            cluster,
            query: 0,
            goal: 0,
            overlap: 0.0,
            turn_deg: None,
            distance_m: None,
            same_state: false,
            frames_apart: None,
        };
        Measured { pairs: vec![facts], findings: vec![vec![Finding::NotSeen]] }
    }

    fn clusters(measured: &Measured) -> Vec<u64> {
        measured.pairs.iter().map(|p| p.cluster).collect()
    }

    #[test]
    fn units_count_in_their_order_whenever_they_arrive() {
        let mut ledger = Ledger::new(Some(20));
        assert!(!ledger.enter(2, Ok(unit(2)), 10), "the first two are missing");
        assert!(!ledger.enter(1, Ok(unit(1)), 10));
        assert!(ledger.enter(0, Ok(unit(0)), 10));
        assert_eq!(clusters(&ledger.close(1).unwrap()), [0, 1], "the third was not needed");
        let mut all = Ledger::new(None);
        for i in [1, 0, 2] {
            assert!(!all.enter(i, Ok(unit(i as u64)), 10));
        }
        assert_eq!(clusters(&all.close(1).unwrap()), [0, 1, 2]);
    }

    #[test]
    fn a_unit_that_fails_ends_the_run() {
        let mut ledger = Ledger::new(Some(20));
        let failed = || Err(RunError::Recording("damaged".into()));
        assert!(ledger.enter(1, failed(), 0));
        assert!(ledger.close(1).unwrap_err().to_string().contains("damaged"));
    }
}
