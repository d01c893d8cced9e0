//! Draws what a tyre gives along and across its heading over its slip: `docs/tyres.svg`.
//!
//! `cargo run -p pita-game --example tyre_curves -- docs/tyres.svg`

mod rig;

use std::error::Error;

use plotters::prelude::*;
use rig::Rig;

/// Slips: a decade in ten steps.
fn slips() -> impl Iterator<Item = f64> {
    (-40..=0).map(|step| 10f64.powf(f64::from(step) / 10.0))
}

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("where to? usage: tyre_curves FILE.svg")?;
    let root = SVGBackend::new(&file, (960, 480)).into_drawing_area();
    root.fill(&WHITE)?;
    let title = "A wheel of the default car, 3 kN, 20 m/s, friction 1: force of the ground over the load";
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(52)
        .build_cartesian_2d((1e-4..1.0).log_scale(), 0.0..1.2)?;
    let slip = "slip: share of the hub's speed, or tangent of the slip angle";
    chart.configure_mesh().x_desc(slip).y_desc("force / load").draw()?;
    for (tick_hz, width) in [(30.0, 1), (480.0, 3)] {
        let along = slips().map(|slip| (slip, -Rig::new(tick_hz).along(slip)[0]));
        let across = slips().map(|slip| (slip, -Rig::new(tick_hz).across(slip)[1]));
        for (name, color, curve) in
            [("along", BLUE, along.collect::<Vec<_>>()), ("across", RED, across.collect::<Vec<_>>())]
        {
            let style = color.mix(if width == 1 { 1.0 } else { 0.4 }).stroke_width(width);
            let series = chart.draw_series(LineSeries::new(curve, style))?.label(format!("{name}, {tick_hz} Hz"));
            series.legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
        }
    }
    let at = SeriesLabelPosition::LowerRight;
    chart.configure_series_labels().position(at).border_style(BLACK).background_style(WHITE).draw()?;
    root.present()?;
    Ok(())
}
