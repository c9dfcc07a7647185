//! homing-perception
