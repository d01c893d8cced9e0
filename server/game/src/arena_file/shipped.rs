//! What lies beside the arenas that come with the game, compiled in like them.

/// Names and bytes.
const FILES: [(&str, &[u8]); 1] = [("rock.obj", include_bytes!("../../../../configs/arenas/rock.obj"))];

/// The bytes of a file beside the arenas that come with the game.
///
/// # Errors
/// Text that says that there is none of this name.
pub fn shipped_file(name: &str) -> Result<Vec<u8>, String> {
    let found = FILES.iter().find(|(shipped, _)| *shipped == name);
    found.map(|(_, bytes)| bytes.to_vec()).ok_or_else(|| "no file of this name comes with the game".to_owned())
}
