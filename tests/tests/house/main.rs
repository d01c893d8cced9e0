//! House rules that a machine can check: layering, and documents that name what is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Longest source file, lines.
const LINES_MAX: usize = 800;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            sources(&path, into);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            into.push(path);
        }
    }
}

/// Names under `[dependencies]` of a manifest.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(root().join(manifest)).unwrap();
    let section = text.split("\n[dependencies]").nth(1).unwrap_or("").split("\n[").next().unwrap_or("");
    let names = section.lines().filter_map(|line| line.split(['.', '=', ' ']).next());
    names.filter(|name| !name.is_empty() && !name.starts_with('#')).map(str::to_owned).collect()
}

#[test]
fn layers_know_only_what_they_may() {
    let outside = ["zenoh", "tokio", "rand", "tracing", "rustix", "bincode", "clap", "pita-server", "pita-client"];
    for (manifest, forbidden) in [
        ("server/sim/Cargo.toml", &["pita-game", "pita-protocol"][..]),
        ("server/game/Cargo.toml", &["pita-protocol"]),
        ("protocol/Cargo.toml", &["pita-sim", "pita-game"]),
    ] {
        let named = dependencies(manifest);
        assert!(!named.is_empty(), "{manifest} has no dependencies?");
        for name in outside.iter().chain(forbidden) {
            let is_the_codec = manifest.starts_with("protocol") && *name == "bincode";
            assert!(is_the_codec || !named.contains(*name), "{manifest} must not depend on {name}");
        }
    }
    let client = dependencies("client-sdk/Cargo.toml");
    assert!(!client.contains("pita-sim") && !client.contains("pita-server"), "the client must not know the server");
}

/// The engine and the game are pure: no clock, no I/O.
#[test]
fn engine_and_game_read_no_clock_and_no_disk() {
    let mut files = Vec::new();
    sources(&root().join("server/sim/src"), &mut files);
    sources(&root().join("server/game/src"), &mut files);
    assert!(files.len() > 20);
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for impure in [
            "std::time",
            "std::fs",
            "std::net",
            "std::env",
            "std::thread",
            "println!",
            "HashMap",
            "HashSet",
            "Instant",
            "SystemTime",
        ] {
            assert!(!text.contains(impure), "{} uses {impure}", file.display());
        }
    }
}

#[test]
fn files_fit_a_head() {
    let mut files = Vec::new();
    sources(&root(), &mut files);
    for file in files {
        let lines = fs::read_to_string(&file).unwrap().lines().count();
        assert!(lines <= LINES_MAX, "{} has {lines} lines", file.display());
        assert!(!file.ends_with("utils.rs"), "{}: name it for what it owns", file.display());
    }
}

/// Every path that the documents name exists.
#[test]
fn documents_name_what_is_there() {
    for document in ["README.md", "ARCHITECTURE.md", "TALK.md"] {
        let text = fs::read_to_string(root().join(document)).unwrap();
        let paths = text.split('`').skip(1).step_by(2).filter(|code| {
            let is_path = code.contains('/') && !code.contains([' ', '<', '*', '|']);
            is_path && [".rs", ".toml", ".md"].iter().any(|extension| code.ends_with(extension))
        });
        let within = ["server/sim/src", "server/game/src"];
        for path in paths {
            let found =
                root().join(path).exists() || within.iter().any(|folder| root().join(folder).join(path).exists());
            assert!(found, "{document} names `{path}`");
        }
    }
    let talk = fs::read_to_string(root().join("TALK.md")).unwrap();
    assert!(talk.lines().count() > 40);
}
