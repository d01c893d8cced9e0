//! `pita-server check`: validates configuration and arena files.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use comfy_table::{Table, presets};
use pita_game::ArenaSettings;
use pita_game::arena_file::FILE_MAX;
use serde_json::json;

use crate::arena_source::{ArenaText, BUILT_IN};
use crate::cli::CheckArgs;
use crate::config::{self, ServerConfig};
use crate::files;
use crate::report;

/// Where configuration lies in a checkout.
const CONFIGS: &str = "configs";

/// What was found out about one file.
struct Checked {
    file: String,
    kind: Kind,
    problem: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Server,
    Arena,
    Unknown,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Server => "server",
            Self::Arena => "arena",
            Self::Unknown => "unknown",
        }
    }
}

/// Checks `args.paths` and prints a line for each file; exit code 1 where anything is wrong.
pub fn run(args: &CheckArgs) -> ExitCode {
    let mut checked = Vec::new();
    if args.paths.is_empty() {
        check_built_in(&mut checked);
        check_path(Path::new(CONFIGS), &mut checked, Missing::IsFine);
    }
    args.paths.iter().for_each(|path| check_path(path, &mut checked, Missing::IsAProblem));
    report::print(&if args.json { json_of(&checked) } else { table_of(&checked) });
    let problems = checked.iter().filter(|file| file.problem.is_some()).count();
    match problems {
        0 => ExitCode::SUCCESS,
        1 => report::failure("1 file is not valid"),
        n => report::failure(&format!("{n} files are not valid")),
    }
}

fn check_built_in(into: &mut Vec<Checked>) {
    into.push(check_server(config::BUILT_IN.to_owned(), Kind::Server, config::DEFAULT_TEXT));
    for (name, text) in BUILT_IN {
        into.push(check_arena(format!("built-in arena {name}"), &ArenaText::built_in(name, text)));
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Missing {
    IsFine,
    IsAProblem,
}

/// Checks a file, or the files of a folder: `server.toml` and everything in `arenas/`, or every arena where the folder
/// is one of arenas.
fn check_path(path: &Path, into: &mut Vec<Checked>, missing: Missing) {
    if !path.is_dir() {
        if path.exists() || missing == Missing::IsAProblem {
            into.push(check_file(path));
        }
        return;
    }
    let mut files = toml_files(path);
    files.extend(toml_files(&path.join("arenas")));
    if files.is_empty() && missing == Missing::IsAProblem {
        let problem = Some("no .toml file in this folder or its arenas/".to_owned());
        into.push(Checked { file: path.display().to_string(), kind: Kind::Unknown, problem });
    }
    files.iter().for_each(|file| into.push(check_file(file)));
}

/// The .toml files right in `folder`, in order of name.
fn toml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    files.sort();
    files
}

fn check_file(path: &Path) -> Checked {
    let file = path.display().to_string();
    match files::read_text(path, FILE_MAX) {
        Ok(text) => match kind_of(path, &text) {
            Kind::Arena => check_arena(file, &ArenaText::of_file(path, text)),
            kind => check_server(file, kind, &text),
        },
        Err(error) => Checked { problem: Some(format!("{file}: {error}")), kind: Kind::Unknown, file },
    }
}

/// By name and folder, else by content: configuration has one of its sections.
fn kind_of(path: &Path, text: &str) -> Kind {
    if path.file_name().is_some_and(|name| name == "server.toml") {
        return Kind::Server;
    }
    if path.parent().is_some_and(|folder| folder.ends_with("arenas")) {
        return Kind::Arena;
    }
    let sections = ["network", "arena", "tick", "sessions", "report"];
    match text.parse::<toml::Table>() {
        Ok(table) if sections.iter().any(|name| table.get(*name).is_some_and(toml::Value::is_table)) => Kind::Server,
        Ok(_) => Kind::Arena,
        Err(_) => Kind::Unknown,
    }
}

fn check_server(file: String, kind: Kind, text: &str) -> Checked {
    let problem = ServerConfig::parse(text, &file).err().map(|error| error.to_string());
    Checked { file, kind, problem }
}

fn check_arena(file: String, text: &ArenaText) -> Checked {
    Checked { file, kind: Kind::Arena, problem: problem_of(text).err() }
}

/// Builds an arena as it is, and with its parameters as far as they may be chosen.
fn problem_of(text: &ArenaText) -> Result<(), String> {
    let settings = ArenaSettings { tick_hz: 30, threads: 1 };
    text.build(&settings).map_err(|error| error.to_string())?;
    for given in text.extremes().map_err(|error| error.to_string())? {
        text.with(&given).and_then(|text| text.build(&settings)).map_err(|error| {
            let given: Vec<_> = given.iter().map(|(name, value)| format!("--set {name}={value}")).collect();
            format!("{error} (with {})", given.join(" "))
        })?;
    }
    Ok(())
}

fn json_of(checked: &[Checked]) -> String {
    let files: Vec<_> = checked
        .iter()
        .map(|c| json!({ "file": c.file, "kind": c.kind.name(), "ok": c.problem.is_none(), "problem": c.problem }))
        .collect();
    format!("{:#}", json!({ "files": files }))
}

fn table_of(checked: &[Checked]) -> String {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(["file", "kind", "result"]);
    for c in checked {
        table.add_row([c.file.as_str(), c.kind.name(), c.problem.as_deref().unwrap_or("ok")]);
    }
    table.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is built in is good however its parameters are chosen; what is bad at the end of one is told so.
    #[test]
    fn parameters_are_checked_to_their_ends() {
        for (name, text) in BUILT_IN {
            assert_eq!(check_arena(String::new(), &ArenaText::built_in(name, text)).problem, None, "{name}");
        }
        let (_, stress) = BUILT_IN[3];
        let wide = stress.replace("max = 48", "max = 400");
        let problem = check_arena(String::new(), &ArenaText::built_in("stress", &wide)).problem.unwrap();
        assert!(problem.contains("actors[0]") && problem.ends_with("(with --set size=400)"), "{problem}");
    }
}
