//! Models as drop-ins: what is refused, where they run, what they give, and what happens when they fail in flight.

#![expect(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a failing test should say where")]

mod bytes;
mod flight;
mod real;
mod refusals;
mod support;
mod switch;
mod working;
