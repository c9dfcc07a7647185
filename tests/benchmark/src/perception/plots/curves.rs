//! Shares of errors below x, x on a logarithmic axis: errors of good and of bad configurations lie a hundredfold apart.

use plotters::prelude::*;

use super::style::{GRID, HEAD_PX, PlotError, SIZE, colour, ink, pale};

/// One configuration's errors; infinite where it failed.
pub(super) struct Curve {
    pub name: String,
    pub errors: Vec<f64>,
}

/// Several in one picture.
pub(super) struct Curves<'a> {
    pub title: &'a str,
    pub subtitle: &'a str,
    pub x_axis: &'a str,
    /// Labelled values of the axis, ascending; it spans them.
    pub x_labels: &'a [f64],
    pub curves: &'a [Curve],
}

impl Curves<'_> {
    pub(super) fn draw(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        self.draw_into(&mut svg).map_err(PlotError::new)?;
        Ok(svg)
    }

    fn draw_into(&self, svg: &mut String) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
        let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        root.draw(&Text::new(self.title, (24, 18), ink(26)))?;
        root.draw(&Text::new(self.subtitle, (24, 52), pale(16)))?;
        let [x_min, .., x_max] = self.x_labels else { return Ok(()) };
        let x_axis = (*x_min..*x_max).log_scale().with_key_points(self.x_labels.to_vec());
        let mut chart = ChartBuilder::on(&root)
            .margin_top(HEAD_PX)
            .margin_left(12)
            .margin_right(32)
            .margin_bottom(12)
            .x_label_area_size(56)
            .y_label_area_size(76)
            .build_cartesian_2d(x_axis, 0.0..100.0)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(GRID)
            .x_desc(self.x_axis)
            .y_desc("percent of pairs")
            .x_label_formatter(&|x| format!("{x}"))
            .y_label_formatter(&|y| format!("{y:.0}"))
            .x_labels(self.x_labels.len())
            .y_labels(6)
            .label_style(pale(15))
            .axis_desc_style(ink(16))
            .draw()?;
        for (i, curve) in self.curves.iter().enumerate() {
            let line = colour(i).stroke_width(3);
            chart
                .draw_series(LineSeries::new(steps(&curve.errors, (*x_min, *x_max)), line))?
                .label(curve.name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], line));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::LowerRight)
            .margin(16)
            .legend_area_size(32)
            .background_style(WHITE.mix(0.9))
            .label_font(ink(16))
            .draw()?;
        root.present()
    }
}

/// Corners of the curve, percent, from `x_min` to `x_max`.
fn steps(errors: &[f64], (x_min, x_max): (f64, f64)) -> Vec<(f64, f64)> {
    let mut below: Vec<f64> = errors.iter().copied().filter(|e| *e < x_max).collect();
    below.sort_by(f64::total_cmp);
    let percent = |n: usize| 100.0 * n as f64 / errors.len().max(1) as f64;
    let n_before = below.iter().filter(|e| **e <= x_min).count();
    let corners = (n_before..below.len()).map(|i| (below[i], percent(i + 1)));
    core::iter::once((x_min, percent(n_before))).chain(corners).chain([(x_max, percent(below.len()))]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_climbs_at_every_error() {
        let corners = steps(&[3.0, 0.05, 1.0, f64::INFINITY, 30.0], (0.1, 20.0));
        assert_eq!(corners, [(0.1, 20.0), (1.0, 40.0), (3.0, 60.0), (20.0, 60.0)]);
    }
}
