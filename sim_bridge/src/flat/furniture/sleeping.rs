//! Beds.

use super::super::pen::Pen;
use super::super::style::{RoomStyle, Style};

/// A bed with its head against the wall: frame, mattress, duvet, pillows.
pub(super) fn bed(pen: &mut Pen<'_>, width: f64, look: &RoomStyle, style: &Style) {
    let half = 0.5 * width;
    pen.cuboid(&look.wood, [-half, 0.0, 0.0], [half, 0.05, 0.95]);
    pen.cuboid(&look.wood, [-half, 0.05, 0.1], [half, 2.06, 0.3]);
    pen.cuboid(&look.wood, [-half, 2.04, 0.0], [half, 2.08, 0.4]);
    for x in [-half + 0.05, half - 0.05] {
        pen.post(&look.wood, (x, 0.3), 0.03, (0.0, 0.12));
    }
    pen.cushion(&style.white, [-half + 0.02, 0.06, 0.28], [half - 0.02, 2.03, 0.48], 0.05);
    pen.cushion(&look.fabric, [-half - 0.02, 0.62, 0.36], [half + 0.02, 2.04, 0.56], 0.07);
    pen.cushion(&look.accent, [-half - 0.025, 1.4, 0.4], [half + 0.025, 1.9, 0.575], 0.06);
    let pillows: &[f64] = if width > 1.2 { &[-0.25, 0.25] } else { &[0.0] };
    for share in pillows {
        let x = share * width;
        pen.cushion(&style.white, [x - 0.33, 0.1, 0.46], [x + 0.33, 0.52, 0.62], 0.08);
    }
}
