//! What `solvers` found as a section of a Markdown document, so that nobody types its figures.

use std::fmt::Write;
use std::path::Path;

use pita_protocol::build_info::VERSION_AND_COMMIT;

use super::contenders::Contender;
use super::report::{Best, work};
use super::{EVERY, Measured};
use crate::yardstick::judge::three_digits;

/// Between these lines a document has what was found.
const BEGIN: &str = "<!-- pita-bench solvers -->";
const END: &str = "<!-- /pita-bench solvers -->";

/// Replaces the section in the document at `path`.
///
/// # Errors
/// Where there is no such document, it has no such section, or it cannot be written.
pub fn write(contenders: &[Contender], measured: &[Measured], ticks: u32, path: &Path) -> Result<(), String> {
    let document = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    let replaced = replace(&document, &section(contenders, measured, ticks))?;
    std::fs::write(path, replaced).map_err(|error| error.to_string())
}

/// A table of work, a row a contender and a column a subject, and how `auto` did.
fn section(contenders: &[Contender], measured: &[Measured], ticks: u32) -> String {
    let mut text = format!(
        "Every {EVERY}th of the first {ticks} ticks of each scene (`pita-bench solvers --ticks {ticks}`, \
         {VERSION_AND_COMMIT}).\n\n| method |"
    );
    let mut add = |part: std::fmt::Arguments| text.write_fmt(part).is_ok();
    measured.iter().all(|subject| add(format_args!(" {} |", subject.subject.name)));
    add(format_args!("\n|-|{}\n", "-|".repeat(measured.len())));
    for (i, Contender { name, .. }) in contenders.iter().enumerate() {
        let cells: Vec<_> = measured.iter().map(|subject| work(&subject.tallies[i])).collect();
        add(format_args!("| `{name}` | {} |\n", cells.join(" | ")));
    }
    let autos = measured.iter().map(|subject| {
        let Best { name, auto_over_it } = Best::of(contenders, subject);
        format!("{}: {} times `{name}`", subject.subject.name, three_digits(auto_over_it))
    });
    add(format_args!("\nWork of `auto` and the best fixed choice: {}.\n", autos.collect::<Vec<_>>().join("; ")));
    text
}

/// The document with another section.
fn replace(document: &str, section: &str) -> Result<String, String> {
    let missing = || format!("it has no lines \"{BEGIN}\" and \"{END}\" between which the figures belong: add them");
    let (before, rest) = document.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    Ok(format!("{before}{BEGIN}\n{section}{END}{after}"))
}

#[cfg(test)]
mod tests {
    use super::super::Tally;
    use super::super::contenders::contenders;
    use super::super::subjects::SUBJECTS;
    use super::*;

    #[test]
    fn the_section_is_replaced_and_all_else_stays() {
        let contenders = contenders();
        let tally = Tally { ticks: 1, work: 12_300, islands: 10, unsolved: 1, ..Tally::default() };
        let tallies = vec![tally; contenders.len()];
        let measured: Vec<_> = SUBJECTS.iter().map(|subject| Measured { subject, tallies: tallies.clone() }).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("document.md");
        std::fs::write(&path, format!("before\n{BEGIN}\nold\n{END}\nafter\n")).unwrap();
        for _ in 0..2 {
            write(&contenders, &measured, 60, &path).unwrap();
        }
        let document = std::fs::read_to_string(&path).unwrap();
        assert!(document.starts_with("before\n") && document.ends_with("\nafter\n") && !document.contains("old"));
        let row = format!("| `auto` |{}", " 12.3 (10 %) |".repeat(SUBJECTS.len()));
        assert!(document.contains(&row), "{document}");
        assert_eq!(document.matches("\n| `").count(), contenders.len());
        std::fs::write(&path, "nothing").unwrap();
        assert!(write(&contenders, &measured, 60, &path).unwrap_err().contains(BEGIN));
    }
}
