//! `broadphase`: k-DOP trees of several k beside parry's tree of boxes, sweep and prune, and oriented boxes, on the same
//! swarms in the same run.

mod contenders;
mod swarm;

use std::hint::black_box;
use std::time::Instant;

use glam::DVec3;
use parry3d_f64::math::Pose;
use parry3d_f64::query::details::intersection_test_support_map_support_map;
use parry3d_f64::shape::SupportMap;
use serde_json::{Map, Value, json};

use super::{EntryError, Options, Report};
use contenders::{BroadPhase, KdopContender, OrientedContender, ParryContender, SweepContender};
use swarm::{Hull, Swarm};

const WARM_UP_TICKS: u32 = 20;
const TICKS: u32 = 100;

/// Names that hold for the life of the format of the figures.
type Contender = (&'static str, fn() -> Box<dyn BroadPhase>);

const CONTENDERS: [Contender; 7] = [
    ("kdop6", || Box::<KdopContender<3>>::default()),
    ("kdop14", || Box::<KdopContender<7>>::default()),
    ("kdop18", || Box::<KdopContender<9>>::default()),
    ("kdop26", || Box::<KdopContender<13>>::default()),
    ("parry_bvh", || Box::<ParryContender>::default()),
    ("sweep_and_prune", || Box::<SweepContender>::default()),
    ("oriented_boxes", || Box::<OrientedContender>::default()),
];

/// Measures `options.ticks` ticks of every swarm, 100 by default.
pub fn run(options: &Options) -> Result<Report, EntryError> {
    let header = vec![
        "swarm",
        "bounds",
        "bound, µs",
        "update, µs",
        "search, µs",
        "sum, µs",
        "test, ns",
        "pairs",
        "false",
        "with GJK, µs",
    ];
    let mut report = Report { header, ..Report::default() };
    let ticks = options.ticks.unwrap_or(TICKS);
    for swarm in &mut Swarm::all() {
        let mut broad_phases: Vec<_> = CONTENDERS.iter().map(|(_, make)| make()).collect();
        let mut measured = vec![Measured::default(); CONTENDERS.len()];
        let mut truth = Truth::default();
        for tick in 0..WARM_UP_TICKS + ticks {
            swarm.fly_to(tick);
            let counts = tick >= WARM_UP_TICKS;
            for i in 0..CONTENDERS.len() {
                // They take turns in coming first, which finds cold caches.
                let i = (i + tick as usize) % CONTENDERS.len();
                measured[i].tick(broad_phases[i].as_mut(), &swarm.hulls, counts);
            }
            // The boxes of the first contender miss nothing, and truth is dear: every tenth tick.
            if counts && tick % 10 == 0 {
                truth.look(&measured[0].pairs, &swarm.hulls);
            }
        }
        let mut figures = Map::new();
        for ((name, _), measured) in CONTENDERS.iter().zip(&mut measured) {
            report.rows.push(measured.row(swarm.name, name, &truth));
            figures.insert((*name).to_owned(), measured.figures(&truth));
        }
        figures.insert("touching_pairs".to_owned(), json!(truth.pairs()));
        figures.insert("fine_test_ns".to_owned(), json!(truth.fine_test_ns()));
        report.figures.insert(swarm.name.to_owned(), Value::Object(figures));
    }
    report.notes.push("Medians a tick. `test` is one test of two bounds, `false` the share of pairs that do not touch; oriented boxes have no tree: their search is quadratic. The last column adds a test by GJK for every pair.".to_owned());
    Ok(report)
}

/// What a swarm is like, by GJK.
#[derive(Default)]
struct Truth {
    ticks: usize,
    tested: usize,
    touching: usize,
    ns: f64,
}

impl Truth {
    /// Looks at a tick, of which `pairs` misses nothing that touches.
    fn look(&mut self, pairs: &[(u32, u32)], hulls: &[Hull]) {
        let start = Instant::now();
        self.touching += pairs.iter().filter(|&&pair| touch(hulls, pair)).count();
        self.ns += start.elapsed().as_nanos() as f64;
        self.tested += pairs.len();
        self.ticks += 1;
    }

    /// That touch, a tick.
    fn pairs(&self) -> f64 {
        self.touching as f64 / self.ticks as f64
    }

    /// Of so many pairs a tick, what does not touch. They are of all ticks, truth of every tenth.
    fn false_share(&self, pairs: f64) -> f64 {
        (1.0 - self.pairs() / pairs).max(0.0)
    }

    /// For a pair, ns.
    fn fine_test_ns(&self) -> f64 {
        self.ns / self.tested as f64
    }
}

/// Times of a contender, ns.
#[derive(Clone, Default)]
struct Measured {
    bound: Vec<f64>,
    update: Vec<f64>,
    search: Vec<f64>,
    test: Vec<f64>,
    counts: Vec<f64>,
    pairs: Vec<(u32, u32)>,
}

impl Measured {
    fn tick(&mut self, broad_phase: &mut dyn BroadPhase, hulls: &[Hull], counts: bool) {
        let marks = [
            Instant::now(),
            {
                broad_phase.bound(hulls);
                Instant::now()
            },
            {
                broad_phase.update();
                Instant::now()
            },
            {
                self.pairs.clear();
                broad_phase.search(&mut self.pairs);
                Instant::now()
            },
        ];
        if !counts {
            return;
        }
        let times = [0, 1, 2].map(|i| (marks[i + 1] - marks[i]).as_nanos() as f64);
        for (list, time) in [&mut self.bound, &mut self.update, &mut self.search].into_iter().zip(times) {
            list.push(time);
        }
        self.counts.push(self.pairs.len() as f64);
        let start = Instant::now();
        let neighbours = hulls.len() - 1;
        let hits = (0..neighbours).filter(|&i| black_box(broad_phase.test(i, i + 1))).count();
        self.test.push(start.elapsed().as_nanos() as f64 / neighbours as f64);
        black_box(hits);
    }

    fn row(&mut self, swarm: &str, name: &str, truth: &Truth) -> Vec<String> {
        let [bound, update, search, test] = self.medians();
        let pairs = mean(&self.counts);
        let micro = |ns: f64| format!("{:.1}", ns * 1e-3);
        let times = [bound, update, search, bound + update + search].map(micro);
        let rest = [format!("{test:.1}"), format!("{pairs:.0}"), format!("{:.0} %", 100.0 * truth.false_share(pairs))];
        let with_fine_phase = micro(bound + update + search + pairs * truth.fine_test_ns());
        [swarm.to_owned(), name.to_owned()].into_iter().chain(times).chain(rest).chain([with_fine_phase]).collect()
    }

    fn figures(&mut self, truth: &Truth) -> Value {
        let [bound, update, search, test] = self.medians();
        let pairs = mean(&self.counts);
        json!({
            "bound_us": bound * 1e-3, "update_us": update * 1e-3, "search_us": search * 1e-3, "test_ns": test,
            "pairs": pairs, "false_share": truth.false_share(pairs),
            "with_fine_phase_us": (bound + update + search + pairs * truth.fine_test_ns()) * 1e-3,
        })
    }

    fn medians(&mut self) -> [f64; 4] {
        [&mut self.bound, &mut self.update, &mut self.search, &mut self.test].map(|list| {
            list.sort_unstable_by(f64::total_cmp);
            list[list.len() / 2]
        })
    }
}

fn mean(list: &[f64]) -> f64 {
    list.iter().sum::<f64>() / list.len() as f64
}

/// The hull of points, to parry.
struct Points<'a>(&'a [DVec3]);

impl SupportMap for Points<'_> {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        let points = self.0.iter().copied();
        points.max_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction))).unwrap_or_default()
    }
}

/// Whether two hulls touch.
fn touch(hulls: &[Hull], (a, b): (u32, u32)) -> bool {
    let [a, b] = [a, b].map(|i| Points(&hulls[i as usize].points));
    intersection_test_support_map_support_map(&Pose::IDENTITY, &a, &b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No bound misses what touches, and boxes find the same whoever holds them.
    #[test]
    fn nothing_is_missed() {
        for swarm in &mut Swarm::all() {
            let mut broad_phases: Vec<_> = CONTENDERS.iter().map(|(_, make)| make()).collect();
            for tick in 0..12 {
                swarm.fly_to(tick);
                let found: Vec<_> = broad_phases
                    .iter_mut()
                    .map(|broad_phase| {
                        let mut pairs = Vec::new();
                        broad_phase.bound(&swarm.hulls);
                        broad_phase.update();
                        broad_phase.search(&mut pairs);
                        pairs.sort_unstable();
                        pairs
                    })
                    .collect();
                assert_eq!(found[0], found[4], "k = 6 and parry, {}, tick {tick}", swarm.name);
                assert_eq!(found[0], found[5], "k = 6 and sweep and prune, {}, tick {tick}", swarm.name);
                let touching: Vec<_> = found[0].iter().copied().filter(|&pair| touch(&swarm.hulls, pair)).collect();
                for (pairs, (name, _)) in found.iter().zip(CONTENDERS) {
                    let missed = touching.iter().find(|pair| pairs.binary_search(pair).is_err());
                    assert_eq!(missed, None, "{name}, {}, tick {tick}", swarm.name);
                    let is_kdop = name.starts_with("kdop");
                    assert!(!is_kdop || pairs.len() <= found[0].len(), "{name} is looser than boxes");
                }
            }
        }
    }
}
