//! The arena in the words of the wire.
//!
//! Owns the translation from the game's types to the protocol's and the description that clients join with, kept up to
//! date by events.

mod parts;

use pita_game::{ActorInfo, Arena};
use pita_protocol::Message;
use pita_protocol::dof::Precision;
use pita_protocol::message::{ActorDescription, Description, Effect, Event, EventMessage, StaticDescription};

use parts::{parts, quaternion, shapes, vector};

/// `arena` as it is now, its state sent with `precision`; the description's events begin at 0.
pub fn describe(arena: &Arena, precision: Precision) -> Description {
    let of_static = |info: &pita_game::StaticInfo| {
        let (position, rotation) = (vector(info.position), quaternion(info.rotation));
        shapes(&info.shape).into_iter().map(move |shape| StaticDescription { shape, position, rotation })
    };
    Description {
        arena: arena.name().to_owned(),
        title: arena.title().to_owned(),
        tick: arena.tick(),
        event_sequence: 0,
        gravity: vector(arena.world().settings().gravity),
        precision,
        scores: Vec::new(),
        statics: arena.statics().iter().flat_map(of_static).collect(),
        actors: arena.actors().map(actor).collect(),
    }
}

/// An actor in the words of the wire.
pub fn actor(info: &ActorInfo) -> ActorDescription {
    ActorDescription {
        id: info.id,
        kind: info.kind.to_owned(),
        name: info.name.clone(),
        slot: info.slot,
        parts: info.parts.iter().flat_map(parts).collect(),
    }
}

/// The same for an event: an actor that is too large for one comes without its parts, which is said in the log.
pub fn bounded_actor(info: &ActorInfo) -> ActorDescription {
    let actor = actor(info);
    match check_actor(&actor) {
        Ok(()) => actor,
        Err(reason) => {
            tracing::error!("{reason}; clients do not see it");
            ActorDescription { parts: Vec::new(), ..actor }
        }
    }
}

/// What is wrong with an arena that cannot be described to those who join, in words for a person.
///
/// # Errors
/// That text.
pub fn check(description: &Description) -> Result<(), String> {
    description.actors.iter().try_for_each(check_actor)?;
    let (bytes, most) = (pita_protocol::encode(description).len(), Description::MAX_BYTES);
    if bytes <= most {
        return Ok(());
    }
    let (statics, actors) = (description.statics.len(), description.actors.len());
    Err(format!(
        "the arena takes {bytes} bytes to describe, at most {most} are allowed: it has {statics} pieces of static \
         geometry and {actors} actors; use fewer, or simpler shapes"
    ))
}

fn check_actor(actor: &ActorDescription) -> Result<(), String> {
    let event = EventMessage { sequence: u32::MAX, tick: u64::MAX, event: Event::ActorAdded(actor.clone()) };
    let (bytes, most) = (pita_protocol::encode(&event).len(), EventMessage::MAX_BYTES);
    if bytes <= most {
        return Ok(());
    }
    let ActorDescription { id, kind, name, .. } = actor;
    Err(format!(
        "actor {id} ({kind} {name:?}) takes {bytes} bytes to describe, at most {most} are allowed: give it fewer or \
         simpler parts"
    ))
}

/// Makes `description` contain `event`, which has the number `sequence` and happened at `tick`.
pub fn apply(description: &mut Description, event: &Event, sequence: u32, tick: u64) {
    description.event_sequence = sequence;
    description.tick = tick;
    let place = |id: u32| description.actors.binary_search_by_key(&id, |actor| actor.id);
    match event {
        Event::ActorAdded(added) => match place(added.id) {
            Ok(at) => description.actors[at] = added.clone(),
            Err(at) => description.actors.insert(at, added.clone()),
        },
        Event::ActorRemoved { id } => {
            if let Ok(at) = place(*id) {
                description.actors.remove(at);
            }
            description.scores.retain(|(actor, _)| actor != id);
        }
        Event::Scored { actor, points } => match description.scores.binary_search_by_key(actor, |(id, _)| *id) {
            Ok(at) => description.scores[at].1 = *points,
            Err(at) => description.scores.insert(at, (*actor, *points)),
        },
        Event::RoundBegan { .. } => description.scores.clear(),
        Event::Joined { .. }
        | Event::Left { .. }
        | Event::Said { .. }
        | Event::Effect(_)
        | Event::KnockedOut { .. }
        | Event::RoundEnded { .. }
        | Event::Closing { .. } => {}
    }
}

/// An effect in the words of the wire.
pub fn effect(effect: &pita_game::step::Effect) -> Effect {
    Effect {
        kind: effect.kind.to_owned(),
        actor: effect.actor,
        position: vector(effect.position),
        direction: vector(effect.direction),
        strength: effect.strength as f32,
    }
}

/// The actor that the session on `slot` drives.
pub fn actor_of(description: &Description, slot: u16) -> Option<u32> {
    description.actors.iter().find(|actor| actor.slot == Some(slot)).map(|actor| actor.id)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn actor(id: u32, slot: Option<u16>) -> ActorDescription {
        ActorDescription { id, kind: "vehicle".to_owned(), name: String::new(), slot, parts: Vec::new() }
    }

    #[test]
    fn events_keep_the_description_up_to_date_and_in_order() {
        let mut description = Description {
            arena: "a".to_owned(),
            title: String::new(),
            tick: 0,
            event_sequence: 0,
            gravity: [0.0; 3],
            precision: Precision::default(),
            scores: Vec::new(),
            statics: Vec::new(),
            actors: vec![actor(4, None)],
        };
        apply(&mut description, &Event::ActorAdded(actor(9, Some(3))), 1, 10);
        apply(&mut description, &Event::ActorAdded(actor(7, Some(2))), 2, 11);
        assert_eq!(actor_of(&description, 2), Some(7));
        for (actor, points) in [(9, 1), (4, 7), (9, 2)] {
            apply(&mut description, &Event::Scored { actor, points }, 2, 11);
        }
        assert_eq!(description.scores, [(4, 7), (9, 2)]);
        apply(&mut description, &Event::ActorRemoved { id: 4 }, 3, 12);
        assert_eq!(description.scores, [(9, 2)], "they go with the actor");
        apply(&mut description, &Event::ActorRemoved { id: 5 }, 4, 13);
        assert_eq!(description.actors, [actor(7, Some(2)), actor(9, Some(3))]);
        assert_eq!((description.event_sequence, description.tick), (4, 13));
    }
}
