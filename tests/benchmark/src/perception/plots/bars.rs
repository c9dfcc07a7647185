//! Bars in groups, one for each configuration, with the interval drawn over them.

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::style::{GRID, HEAD_PX, PlotError, SIZE, colour, ink, pale};

/// One bar, and the ends of the line over it.
pub(super) struct Bar {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// Bars side by side; none where there is nothing to show.
pub(super) struct Group {
    pub label: String,
    pub detail: String,
    pub bars: Vec<Bar>,
}

/// Several groups in one picture.
pub(super) struct Bars<'a> {
    pub title: &'a str,
    pub subtitle: &'a str,
    pub y_axis: &'a str,
    /// `None`: as high as the highest line.
    pub y_max: Option<f64>,
    pub names: &'a [String],
    pub groups: &'a [Group],
}

/// Share of a group's width that its bars take.
const FILLED: f64 = 0.72;
type Failed = DrawingAreaErrorKind<std::io::Error>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

impl Bars<'_> {
    pub(super) fn draw(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        self.draw_into(&mut svg).map_err(PlotError::new)?;
        Ok(svg)
    }

    fn draw_into(&self, svg: &mut String) -> Result<(), Failed> {
        let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        root.draw(&Text::new(self.title, (24, 18), ink(26)))?;
        root.draw(&Text::new(self.subtitle, (24, 52), pale(16)))?;
        let n_groups = self.groups.len().max(1) as f64;
        let mut chart = ChartBuilder::on(&root)
            .margin_top(HEAD_PX + 28)
            .margin_left(12)
            .margin_right(32)
            .x_label_area_size(60)
            .y_label_area_size(76)
            .build_cartesian_2d(0.0..n_groups, 0.0..self.top())?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .disable_x_axis()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(GRID)
            .y_desc(self.y_axis)
            .y_label_formatter(&|y| format!("{y:.0}"))
            .y_labels(6)
            .label_style(pale(15))
            .axis_desc_style(ink(16))
            .draw()?;
        for (g, group) in self.groups.iter().enumerate() {
            self.draw_group(&root, &mut chart, g as f64, group)?;
        }
        self.draw_names(&root)?;
        root.present()
    }

    fn top(&self) -> f64 {
        let highest = self.groups.iter().flat_map(|g| &g.bars).map(|b| b.high).fold(0.0, f64::max);
        self.y_max.unwrap_or(1.08 * highest).max(1e-3)
    }

    fn draw_group<'b>(
        &self,
        root: &DrawingArea<SVGBackend<'b>, Shift>,
        chart: &mut Chart<'_, 'b>,
        left: f64,
        group: &Group,
    ) -> Result<(), Failed> {
        let width = FILLED / self.names.len().max(1) as f64;
        let whisker = RGBColor(40, 44, 52).stroke_width(2);
        for (i, bar) in group.bars.iter().enumerate() {
            let x = left + 0.5 * (1.0 - FILLED) + i as f64 * width;
            let (from, to) = (x + 0.06 * width, x + 0.94 * width);
            let middle = 0.5 * (from + to);
            chart.draw_series([Rectangle::new([(from, 0.0), (to, bar.value)], colour(i).filled())])?;
            chart.draw_series([PathElement::new([(middle, bar.low), (middle, bar.high)], whisker)])?;
            let (x_px, y_px) = chart.backend_coord(&(middle, bar.high));
            let anchored = ink(14).pos(Pos::new(HPos::Center, VPos::Bottom));
            let digits = usize::from(self.y_max.is_none() && bar.value < 10.0);
            root.draw(&Text::new(format!("{:.digits$}", bar.value), (x_px, y_px - 3), anchored))?;
        }
        let (x_px, y_px) = chart.backend_coord(&(left + 0.5, 0.0));
        let centred = |style: TextStyle<'static>| style.pos(Pos::new(HPos::Center, VPos::Top));
        root.draw(&Text::new(group.label.clone(), (x_px, y_px + 10), centred(ink(16))))?;
        root.draw(&Text::new(group.detail.clone(), (x_px, y_px + 32), centred(pale(14))))
    }

    /// A line of squares and names above the axes.
    fn draw_names(&self, root: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Failed> {
        let mut x = 88;
        for (i, name) in self.names.iter().enumerate() {
            let y = HEAD_PX as i32;
            root.draw(&Rectangle::new([(x, y), (x + 14, y + 14)], colour(i).filled()))?;
            root.draw(&Text::new(name.clone(), (x + 20, y), ink(15)))?;
            // Letters are 8 px wide on average.
            x += 52 + 8 * name.chars().count() as i32;
        }
        Ok(())
    }
}
