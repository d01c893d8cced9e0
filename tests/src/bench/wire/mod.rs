//! `wire`: what the state costs on the wire, beside what others have published.
//!
//! Scenes are simulated, coded, decoded and compared in this process; there is no network in the loop but a model of
//! one: a snapshot is acknowledged a round trip of 100 ms after it was sent, so baselines are 6 ticks old at 60 Hz and
//! 3 at 30 Hz, and in the lossy variants 5 % of snapshots and of acknowledgements do not arrive.

mod fan_out;
mod scenes;
mod stopwatch;
mod stream;
mod trace;

use serde_json::json;

use super::{EntryError, Options, Report};
use stream::{Cost, Link, median};
use trace::Trace;

const CLEAN: Link = Link { round_trip_ms: 100, loss: 0.0 };
const LOSSY: Link = Link { loss: 0.05, ..CLEAN };
const TICKS: u32 = 900;

/// Measures `options.ticks` ticks of each scene, 900 by default.
pub fn run(options: &Options) -> Result<Report, EntryError> {
    let ticks = options.ticks.unwrap_or(TICKS).max(120) as usize;
    let header = vec!["scene", "ours", "with 5 % loss", "the bar", "published by others"];
    let mut report = Report { header, ..Report::default() };
    cubes(&scenes::cubes(ticks)?, &mut report)?;
    bodies(&scenes::asteroids(ticks)?, &mut report)?;
    arena(&scenes::arena(ticks)?, &mut report)?;
    report.notes.push(
        "Bytes are those of the coded state, without message and transport headers. Times are \
         medians of CPU time of one thread. In motion: faster than 2 cm/s or 0.05 rad/s."
            .to_owned(),
    );
    Ok(report)
}

/// Both links, with the figures that all scenes have.
fn both(trace: &Trace, name: &str, report: &mut Report) -> Result<(Cost, Cost), EntryError> {
    let (mut clean, lossy) = (stream::run(trace, CLEAN)?, stream::run(trace, LOSSY)?);
    let (moving, least) = trace.moving();
    let (encode, decode) = (median(&mut clean.encode_us), median(&mut clean.decode_us));
    let bits = clean.mean_bytes() * 8.0 / moving.max(1.0);
    report.notes.push(format!(
        "{name}: {moving:.1} of {} in motion (least {least}), {bits:.1} bits per body in motion, {:.0} bytes a snapshot, \
         encoding {encode:.0} µs, decoding {decode:.0} µs, off by at most {:.2} mm and {:.3}° at rest, {:.2} mm and \
         {:.3}° in motion",
        trace.ticks[0].len(),
        clean.mean_bytes(),
        clean.rest.0,
        clean.rest.1,
        clean.motion.0,
        clean.motion.1,
    ));
    report.figures.insert(format!("{name}_moving"), json!(moving));
    report.figures.insert(format!("{name}_bits_per_moving_body"), json!(bits));
    report.figures.insert(format!("{name}_decode_us"), json!(decode));
    report.figures.insert(format!("{name}_encode_us"), json!(encode));
    Ok((clean, lossy))
}

fn row(report: &mut Report, scene: &str, key: &str, [ours, lossy]: [f64; 2], unit: &str, bar: &str, others: &str) {
    let cells = [scene.to_owned(), format!("{ours:.1} {unit}"), format!("{lossy:.1} {unit}")];
    report.rows.push([&cells[..], &[bar.to_owned(), others.to_owned()]].concat());
    report.figures.insert(key.to_owned(), json!(ours));
    report.figures.insert(format!("lossy_{key}"), json!(lossy));
}

fn cubes(trace: &Trace, report: &mut Report) -> Result<(), EntryError> {
    let (clean, lossy) = both(trace, "cubes901", report)?;
    let kbps = |cost: &Cost| cost.mean_bytes() * 8.0 * f64::from(trace.tick_hz) / 1e3;
    let others = "Fiedler 255, best known 213";
    let ours = [kbps(&clean), kbps(&lossy)];
    row(report, "901 cubes, 60 Hz, 1/512 m, 9 bits", "cubes901_kbps", ours, "kbps", "200", others);
    Ok(())
}

fn bodies(trace: &Trace, report: &mut Report) -> Result<(), EntryError> {
    let (clean, lossy) = both(trace, "bodies250", report)?;
    let ours = [&clean, &lossy].map(|cost| kilobytes(cost, trace));
    let others = "15, others 100 to 185, with transport";
    row(report, "250 bodies, 30 Hz, 0.01 m, 0.001", "bodies250_kBps", ours, "kB/s", "10", others);
    Ok(())
}

fn arena(trace: &Trace, report: &mut Report) -> Result<(), EntryError> {
    let (mut clean, lossy) = both(trace, "arena64", report)?;
    let ours = [&clean, &lossy].map(|cost| kilobytes(cost, trace));
    row(report, "arena with 64 cars, 30 Hz", "arena64_kBps", ours, "kB/s", "24", "");
    for (key, figure) in [
        ("arena64_rest_error_mm", clean.rest.0),
        ("arena64_rest_error_deg", clean.rest.1),
        ("arena64_motion_error_mm", clean.motion.0),
        ("decode_us", median(&mut clean.decode_us)),
    ] {
        report.figures.insert(key.to_owned(), json!(figure));
    }
    let served = fan_out::run(trace)?;
    report.rows.push(vec![
        "encoding for 200 clients".to_owned(),
        format!("{:.2} ms a tick", served.encode_ms),
        String::new(),
        "2".to_owned(),
        String::new(),
    ]);
    report.notes.push(format!(
        "200 clients: the cell once for all, {:.0} bytes a tick, and each client's own car, {:.1} bytes",
        served.cell_bytes, served.own_bytes
    ));
    report.figures.insert("encode200_ms".to_owned(), json!(served.encode_ms));
    let cell = served.cell_bytes * f64::from(trace.tick_hz) / 1e3;
    report.figures.insert("arena64_cell_kBps".to_owned(), json!(cell));
    Ok(())
}

fn kilobytes(cost: &Cost, trace: &Trace) -> f64 {
    cost.mean_bytes() * f64::from(trace.tick_hz) / 1e3
}
