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

use pita_server::config::ServerConfig;
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
    let header = vec!["measured", "ours", "with 5 % loss", "the bar: below", "reached", "published by others"];
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

/// A figure that is to stay below a bar.
struct Bar {
    what: &'static str,
    key: &'static str,
    unit: &'static str,
    bar: f64,
    /// What others have published.
    others: &'static str,
    /// Whether as much moves in the scene as the bar asks for; a calmer one is cheap.
    is_lively: bool,
}

/// Cubes that are to be in motion on average, and bodies that are at any time.
const CUBES_MOVING: f64 = 80.0;
const BODIES_MOVING: usize = 200;

impl Bar {
    /// Adds a row for `ours`, and what it is over a link that loses, which has to stay below the bar too.
    fn compare(&self, report: &mut Report, ours: f64, lossy: Option<f64>) {
        let Self { what, key, unit, bar, others, is_lively } = *self;
        let is_reached = is_lively && ours < bar && lossy.is_none_or(|lossy| lossy < bar);
        let with_unit = |figure: f64| format!("{figure:.2} {unit}");
        report.rows.push(vec![
            what.to_owned(),
            with_unit(ours),
            lossy.map(with_unit).unwrap_or_default(),
            bar.to_string(),
            match (is_reached, is_lively) {
                (true, _) => "yes",
                (false, true) => "NO",
                (false, false) => "NO: too calm",
            }
            .to_owned(),
            others.to_owned(),
        ]);
        report.figures.insert(key.to_owned(), json!(ours));
        report.figures.insert(format!("{key}_bar"), json!(bar));
        report.figures.insert(format!("{key}_reached"), json!(is_reached));
        if let Some(lossy) = lossy {
            report.figures.insert(format!("lossy_{key}"), json!(lossy));
        }
    }
}

fn cubes(trace: &Trace, report: &mut Report) -> Result<(), EntryError> {
    let (clean, lossy) = both(trace, "cubes901", report)?;
    let kbps = |cost: &Cost| cost.mean_bytes() * 8.0 * f64::from(trace.tick_hz) / 1e3;
    let (what, others) = ("901 cubes, 60 Hz, 1/512 m, 9 bits", "Fiedler 255, best known 213");
    let is_lively = trace.moving().0 >= CUBES_MOVING;
    let bar = Bar { what, key: "cubes901_kbps", unit: "kbps", bar: 200.0, others, is_lively };
    bar.compare(report, kbps(&clean), Some(kbps(&lossy)));
    Ok(())
}

fn bodies(trace: &Trace, report: &mut Report) -> Result<(), EntryError> {
    let (clean, lossy) = both(trace, "bodies250", report)?;
    let (what, others) = ("250 bodies, 30 Hz, 0.01 m, 0.001", "15, others 100 to 185, with transport");
    let is_lively = trace.moving().1 >= BODIES_MOVING;
    let bar = Bar { what, key: "bodies250_kBps", unit: "kB/s", bar: 10.0, others, is_lively };
    bar.compare(report, kilobytes(&clean, trace), Some(kilobytes(&lossy, trace)));
    Ok(())
}

fn arena(trace: &Trace, report: &mut Report) -> Result<(), EntryError> {
    let (mut clean, mut lossy) = both(trace, "arena64", report)?;
    let mut compare = |what, key, unit, bar, ours, lossy| {
        Bar { what, key, unit, bar, others: "", is_lively: true }.compare(report, ours, lossy);
    };
    let bytes = [&clean, &lossy].map(|cost| kilobytes(cost, trace));
    compare("arena with 64 cars, 30 Hz, one stream", "arena64_kBps", "kB/s", 24.0, bytes[0], Some(bytes[1]));
    compare("  off at rest", "arena64_rest_error_mm", "mm", 5.0, clean.rest.0, Some(lossy.rest.0));
    compare("  turned at rest", "arena64_rest_error_deg", "°", 0.2, clean.rest.1, Some(lossy.rest.1));
    compare("  off in motion", "arena64_motion_error_mm", "mm", 20.0, clean.motion.0, Some(lossy.motion.0));
    let decode = [&mut clean, &mut lossy].map(|cost| median(&mut cost.decode_us));
    compare("  decoding a snapshot", "decode_us", "µs", 50.0, decode[0], Some(decode[1]));
    let side_m = ServerConfig::built_in().cells.side_m.get() as f32;
    let served = fan_out::run(trace, side_m)?;
    let client = served.client_bytes * f64::from(trace.tick_hz) / 1e3;
    compare("  a client that takes all cells", "arena64_client_kBps", "kB/s", 24.0, client, None);
    compare("  publishing for 200 clients", "encode200_ms", "ms", 2.0, served.encode_ms, None);
    for side_m in [side_m, 32.0, 128.0, 4096.0] {
        let served = fan_out::run(trace, side_m)?;
        let [cells, client] =
            [served.cell_bytes, served.client_bytes].map(|bytes| bytes * f64::from(trace.tick_hz) / 1e3);
        report.notes.push(format!(
            "200 clients, cells of {side_m} m: {} of them, {cells:.1} kB/s in all, each client's own snapshot {:.1} bytes a \
             tick, a client with its cells {client:.1} kB/s, {:.2} ms of the publishing thread a tick",
            served.cells, served.own_bytes, served.encode_ms
        ));
        report.figures.insert(format!("arena64_client_{side_m}m_kBps"), json!(client));
    }
    Ok(())
}

fn kilobytes(cost: &Cost, trace: &Trace) -> f64 {
    cost.mean_bytes() * f64::from(trace.tick_hz) / 1e3
}
