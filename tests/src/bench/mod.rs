//! `pita-bench`: one program for all measurements, each a named entry.
//!
//! Owns the list of entries and how their results are shown. An entry measures and answers a [`Report`]; it prints
//! nothing, and where it compares with a peer, the peer runs in the same process and the same run.

mod broadphase;
mod peers;
mod published;
mod solvers;
mod tick;
mod wire;

use std::path::PathBuf;

use serde_json::{Map, Value};

use crate::table::table;

/// Every measurement, in the order in which they run.
pub const ENTRIES: &[Entry] = &[
    Entry { name: "tick", measures: "a tick of 16 driven cars: ms a stage, iterations, allocations", run: tick::run },
    Entry {
        name: "broadphase",
        measures: "k-DOP trees of several k beside parry's tree of boxes and others: time, pairs, false pairs",
        run: broadphase::run,
    },
    Entry {
        name: "peers",
        measures: "ours and rapier in turn on the yardstick's scenes: ms, ratio, quality; minutes",
        run: peers::run,
    },
    Entry {
        name: "published",
        measures: "scenes that others have published figures for, theirs beside ours, at their time step and at ours",
        run: published::run,
    },
    Entry {
        name: "solvers",
        measures: "which method is best: work and time of every solver and preconditioner; minutes",
        run: solvers::run,
    },
    Entry {
        name: "wire",
        measures: "bytes, time and error of the coded state beside published figures, without and with loss",
        run: wire::run,
    },
];

/// One named measurement.
pub struct Entry {
    /// What it is called on the command line.
    pub name: &'static str,
    /// What it measures, on one line.
    pub measures: &'static str,
    /// Measures.
    pub run: fn(&Options) -> Result<Report, EntryError>,
}

/// How long and how much to measure.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Ticks to measure; the entry's own number where there is none.
    pub ticks: Option<u32>,
    /// Threads of the engine; the entry's own number where there is none.
    pub threads: Option<usize>,
    /// Scenes to measure, of the yardstick for `peers`, families for `published`; all of them where none is named.
    pub scenes: Vec<String>,
    /// Times that everything is run, the least of which counts; the entry's own number where there is none.
    pub rounds: Option<u32>,
    /// Where `solvers` draws what it found.
    pub plot: Option<PathBuf>,
    /// Markdown document in which `solvers` replaces its section.
    pub document: Option<PathBuf>,
}

/// Why an entry could not measure, for a person.
pub type EntryError = Box<dyn std::error::Error + Send + Sync>;

/// What an entry found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Heads of the table's columns, with units.
    pub header: Vec<&'static str>,
    /// Rows of the table.
    pub rows: Vec<Vec<String>>,
    /// What stands below the table, a paragraph each.
    pub notes: Vec<String>,
    /// The same for machines, with units in the keys: `tick_p50_ms`.
    pub figures: Map<String, Value>,
}

impl Report {
    /// The table and what stands below it, for people.
    pub fn text(&self) -> String {
        let table = table(&self.header, self.rows.iter().cloned()).to_string();
        [&[table], &self.notes[..]].concat().join("\n")
    }
}

/// Entries of `names` in the order of [`ENTRIES`]; all of them for no names.
///
/// # Errors
/// The first name that is no entry's, in a sentence that lists the entries.
pub fn select<'a>(entries: &'a [Entry], names: &[String]) -> Result<Vec<&'a Entry>, String> {
    let known: Vec<_> = entries.iter().map(|entry| entry.name).collect();
    match names.iter().find(|name| !known.contains(&name.as_str())) {
        Some(name) => Err(format!("no measurement is called '{name}'; there are: {}", known.join(", "))),
        None => Ok(entries.iter().filter(|e| names.is_empty() || names.iter().any(|name| name == e.name)).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &[Entry] = &[
        Entry { name: "tick", measures: "", run: |_| Ok(Report::default()) },
        Entry { name: "wire", measures: "", run: |_| Err("no wire".into()) },
    ];

    #[test]
    fn names_select_and_a_wrong_one_is_answered_with_the_right_ones() {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let selected =
            |list: &[&str]| select(TWO, &names(list)).map(|es| es.iter().map(|e| e.name).collect::<Vec<_>>());
        assert_eq!(selected(&[]).unwrap(), ["tick", "wire"]);
        assert_eq!(selected(&["wire"]).unwrap(), ["wire"]);
        assert_eq!(selected(&["tik"]).unwrap_err(), "no measurement is called 'tik'; there are: tick, wire");
    }

    #[test]
    fn names_are_unique() {
        let mut names: Vec<_> = ENTRIES.iter().map(|entry| entry.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]) && !names.contains(&"list"), "{names:?}");
    }
}
