//! Tests of the game through its public interface: one binary, a module a subject.

mod actors;
mod arena_files;
mod arenas;
mod collisions;
mod combat;
mod drivers;
mod driving;
mod examples;
mod free_form;
mod handling;
mod pasture;
mod pipeline;
mod players;
mod props;
mod recovery;
mod rehearsals;
mod reloads;
mod reproducibility;
mod sheep;
mod squash;
mod stunts;
mod test_track;
mod tornado;
mod tyres;
