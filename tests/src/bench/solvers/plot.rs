//! Work of every contender on every subject, over that of the best, as SVG.

use std::error::Error;
use std::path::Path;

use plotters::prelude::*;

use super::contenders::Contender;
use super::{Measured, Tally};

/// Size of the picture, pixels.
const SIZE: (u32, u32) = (960, 600);

/// Share of unsolved islands from which on a mark is hollow.
const UNSOLVED: f64 = 0.05;

const COLOURS: [RGBColor; 6] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 39, 40),
    RGBColor(44, 160, 44),
    RGBColor(148, 103, 189),
    RGBColor(255, 127, 14),
    RGBColor(23, 190, 207),
];

/// Draws a row a contender and a colour a subject; hollow marks are of contenders that leave islands unsolved.
///
/// # Errors
/// Where `path` cannot be written.
pub fn draw(contenders: &[Contender], measured: &[Measured], path: &Path) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let ratios: Vec<Vec<f64>> = measured.iter().map(|measured| ratios(&measured.tallies)).collect();
    let worst = ratios.iter().flatten().fold(10.0, |worst: f64, &ratio| worst.max(ratio));
    let rows = contenders.len() as f64;
    let mut chart = ChartBuilder::on(&root)
        .caption("Which method is best? Work of a tick over that of the best", ("sans-serif", 20))
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(290)
        .build_cartesian_2d((0.8..worst * 1.3).log_scale(), -0.6..rows - 0.4)?;
    let name = |row: &f64| {
        let index = rows - 1.0 - row.round();
        let is_row = (row - row.round()).abs() < 1e-6 && index >= 0.0;
        contenders.get(index as usize).filter(|_| is_row).map_or_else(String::new, |contender| contender.name.clone())
    };
    chart
        .configure_mesh()
        .x_desc("work / least work")
        .x_label_formatter(&|ratio| format!("{ratio}"))
        .y_labels(contenders.len() * 2)
        .y_label_formatter(&name)
        .light_line_style(TRANSPARENT)
        .draw()?;
    for ((measured, ratios), colour) in measured.iter().zip(&ratios).zip(COLOURS.into_iter().cycle()) {
        let marks = ratios.iter().zip(&measured.tallies).enumerate().map(|(i, (&ratio, tally))| {
            let style = if tally.unsolved_share() > UNSOLVED { colour.stroke_width(2) } else { colour.filled() };
            Circle::new((ratio, rows - 1.0 - i as f64), 5, style)
        });
        chart
            .draw_series(marks)?
            .label(measured.subject.name)
            .legend(move |(x, y)| Circle::new((x + 10, y), 5, colour.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE)
        .border_style(BLACK)
        .draw()?;
    root.present()?;
    Ok(())
}

/// Work over the least of those that solve the subject; over the least of all where none does.
fn ratios(tallies: &[Tally]) -> Vec<f64> {
    let least = |all: bool| {
        let chosen = tallies.iter().filter(|tally| all || tally.unsolved_share() <= UNSOLVED);
        chosen.map(|tally| tally.work.max(1)).min()
    };
    let least = least(false).or_else(|| least(true)).unwrap_or(1) as f64;
    tallies.iter().map(|tally| tally.work.max(1) as f64 / least).collect()
}

#[cfg(test)]
mod tests {
    use super::super::contenders::contenders;
    use super::super::subjects::SUBJECTS;
    use super::*;

    #[test]
    fn a_plot_names_every_contender_and_subject() {
        let contenders = contenders();
        let tallies: Vec<_> = (0..contenders.len() as u64)
            .map(|i| Tally { ticks: 1, work: 1000 << i, islands: 10, unsolved: (i % 2) as usize, ..Tally::default() })
            .collect();
        let measured: Vec<_> = SUBJECTS.iter().map(|subject| Measured { subject, tallies: tallies.clone() }).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("solvers.svg");
        draw(&contenders, &measured, &path).unwrap();
        let svg = std::fs::read_to_string(&path).unwrap();
        for name in contenders.iter().map(|c| c.name.as_str()).chain(SUBJECTS.iter().map(|s| s.name)) {
            assert!(svg.contains(name), "{name} is missing");
        }
    }
}
