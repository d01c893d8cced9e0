//! Puts the commit into the binaries; a source tree without git builds too and says `unknown`.
use vergen_gitcl::{Emitter, Gitcl};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // What git answers below replaces this.
    println!("cargo:rustc-env=VERGEN_GIT_SHA=unknown");
    let git = Gitcl::builder().sha(true).build();
    Emitter::default().quiet().add_instructions(&git)?.emit()?;
    Ok(())
}
