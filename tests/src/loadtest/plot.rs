//! Tick time against clients or vehicles, as SVG.

use std::error::Error;
use std::path::Path;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::figures::{FRAME_60_HZ_MS, Quantiles, TICK_30_HZ_MS};
use super::options::Counted;
use super::report::Step;

/// Size of the picture, pixels.
const SIZE: (u32, u32) = (900, 560);

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn = Result<(), Box<dyn Error>>;

/// Draws p50 and p99 of the tick time of `steps` with the lines at 16.7 and 33.3 ms; steps with starved bots are
/// crossed.
///
/// # Errors
/// Where `path` cannot be written.
pub fn draw(steps: &[Step], counted: Counted, title: &str, path: &Path) -> Drawn {
    let mut steps = steps.to_vec();
    steps.sort_by_key(|step| step.count);
    let steps = &steps[..];
    let root = SVGBackend::new(path, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let count_end = steps.iter().map(|step| step.count).max().unwrap_or(1).max(1) as f64 * 1.02;
    let tick_end_ms = steps.iter().map(|step| step.ticks.tick.p99_ms).fold(TICK_30_HZ_MS, f64::max) * 1.15;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d(0.0..count_end, 0.0..tick_end_ms)?;
    chart
        .configure_mesh()
        .x_desc(counted.name())
        .y_desc("tick time, ms")
        .x_label_formatter(&|x| if x.fract() == 0.0 { x.to_string() } else { String::new() })
        .y_label_formatter(&|y| format!("{y:.0}"))
        .light_line_style(TRANSPARENT)
        .draw()?;
    draw_limit(&mut chart, FRAME_60_HZ_MS, "16.7 ms")?;
    draw_limit(&mut chart, TICK_30_HZ_MS, "33.3 ms")?;
    draw_curve(&mut chart, steps, "p50", RGBColor(31, 119, 180), |tick| tick.p50_ms)?;
    draw_curve(&mut chart, steps, "p99", RGBColor(214, 39, 40), |tick| tick.p99_ms)?;
    draw_starved(&mut chart, steps)?;
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE)
        .border_style(BLACK)
        .draw()?;
    root.present()?;
    Ok(())
}

fn draw_limit(chart: &mut Chart, limit_ms: f64, label: &'static str) -> Drawn {
    let count_end = chart.x_range().end;
    let above = (count_end * 0.93, limit_ms + chart.y_range().end * 0.035);
    chart.draw_series(LineSeries::new([(0.0, limit_ms), (count_end, limit_ms)], BLACK.mix(0.7).stroke_width(2)))?;
    chart.draw_series([Text::new(label, above, ("sans-serif", 13))])?;
    Ok(())
}

fn draw_curve(
    chart: &mut Chart,
    steps: &[Step],
    name: &'static str,
    colour: RGBColor,
    of: impl Fn(&Quantiles) -> f64,
) -> Drawn {
    let points: Vec<_> = steps.iter().map(|step| (step.count as f64, of(&step.ticks.tick))).collect();
    chart
        .draw_series(LineSeries::new(points.iter().copied(), colour.stroke_width(2)))?
        .label(name)
        .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    chart.draw_series(points.into_iter().map(|point| Circle::new(point, 4, colour.filled())))?;
    Ok(())
}

fn draw_starved(chart: &mut Chart, steps: &[Step]) -> Drawn {
    let starved: Vec<_> = steps.iter().filter(|step| step.bots_starved).collect();
    if starved.is_empty() {
        return Ok(());
    }
    chart
        .draw_series(starved.iter().map(|step| Cross::new((step.count as f64, step.ticks.tick.p99_ms), 9, BLACK)))?
        .label("bots starved")
        .legend(|(x, y)| Cross::new((x + 10, y), 5, BLACK));
    Ok(())
}
