//! PITA's game: arenas and actors on the engine, and the pipeline that runs them.
