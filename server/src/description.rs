//! The arena in the words of the wire.
//!
//! Owns the translation from the game's types to the protocol's and the description that clients join with, kept up to
//! date by events.

use glam::{DQuat, DVec3};
use pita_game::{ActorInfo, Arena};
use pita_protocol::message::{ActorDescription, Description, Event, PartDescription, Shape, StaticDescription};

/// `arena` as it is now; the description's events begin at 0.
pub fn describe(arena: &Arena) -> Description {
    let of_static = |info: &pita_game::StaticInfo| {
        let (position, rotation) = (vector(info.position), rotation(info.rotation));
        shapes(&info.shape).into_iter().map(move |shape| StaticDescription { shape, position, rotation })
    };
    Description {
        arena: arena.name().to_owned(),
        title: arena.title().to_owned(),
        tick: arena.tick(),
        event_sequence: 0,
        gravity: vector(arena.world().settings().gravity),
        statics: arena.statics().iter().flat_map(of_static).collect(),
        actors: arena.actors().map(actor).collect(),
    }
}

/// An actor in the words of the wire.
pub fn actor(info: &ActorInfo) -> ActorDescription {
    let part = |part: &pita_game::PartInfo| {
        let slice = part.slice;
        shapes(&part.shape).into_iter().map(move |shape| PartDescription { slice, shape })
    };
    ActorDescription {
        id: info.id,
        kind: info.kind.to_owned(),
        name: info.name.clone(),
        slot: info.slot,
        parts: info.parts.iter().flat_map(part).collect(),
    }
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
        }
        Event::Joined { .. } | Event::Left { .. } | Event::Closing { .. } => {}
    }
}

/// The actor that the session on `slot` drives.
pub fn actor_of(description: &Description, slot: u16) -> Option<u32> {
    description.actors.iter().find(|actor| actor.slot == Some(slot)).map(|actor| actor.id)
}

/// A shape in the words of the wire: a surface is a hull for each of its triangles.
fn shapes(shape: &pita_sim::Shape) -> Vec<Shape> {
    let shape = match shape {
        pita_sim::Shape::Mesh(mesh) => {
            let points = |triangle: &[u32; 3]| triangle.map(|corner| vector(mesh.vertices()[corner as usize])).to_vec();
            return mesh.triangles().iter().map(|t| Shape::Hull { points: points(t), radius: 0.0 }).collect();
        }
        pita_sim::Shape::HalfSpace { normal } => Shape::HalfSpace { normal: vector(*normal) },
        pita_sim::Shape::Ball { radius } => Shape::Ball { radius: *radius as f32 },
        pita_sim::Shape::Box { half } => Shape::Box { half: vector(*half) },
        pita_sim::Shape::Capsule { half_length, radius } => {
            Shape::Capsule { half_length: *half_length as f32, radius: *radius as f32 }
        }
        pita_sim::Shape::Cylinder { half_length, radius, rounding } => {
            Shape::Cylinder { half_length: *half_length as f32, radius: *radius as f32, rounding: *rounding as f32 }
        }
        pita_sim::Shape::Hull { points, radius } => {
            Shape::Hull { points: points.iter().copied().map(vector).collect(), radius: *radius as f32 }
        }
    };
    vec![shape]
}

fn vector(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

fn rotation(q: DQuat) -> [f32; 4] {
    q.as_quat().to_array()
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
            statics: Vec::new(),
            actors: vec![actor(4, None)],
        };
        apply(&mut description, &Event::ActorAdded(actor(9, Some(3))), 1, 10);
        apply(&mut description, &Event::ActorAdded(actor(7, Some(2))), 2, 11);
        assert_eq!(actor_of(&description, 2), Some(7));
        apply(&mut description, &Event::ActorRemoved { id: 4 }, 3, 12);
        apply(&mut description, &Event::ActorRemoved { id: 5 }, 4, 13);
        assert_eq!(description.actors, [actor(7, Some(2)), actor(9, Some(3))]);
        assert_eq!((description.event_sequence, description.tick), (4, 13));
    }
}
