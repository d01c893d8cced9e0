//! Good files, bad files, and bytes that are no files.

use glam::DVec3;
use proptest::prelude::*;

use super::{ConvexPartsDesc, Geometry};
use crate::collide::Shape;
use crate::mass::Density;

const CUBE: &str = "
o cube
v 0 0 0
v 1 0 0
v 0 1 0
v 1 1 0
v 0 0 1
v 1 0 1
v 0 1 1
v 1 1 1
f 1 3 4 2
f 5 6 8 7
f 1 2 6 5
f 3 7 8 4
f 1 5 7 3
f 2 4 8 6
";

/// A glTF text of one triangle at (0 0 0), (1 0 0), (0 1 0), under a node that doubles and moves it.
fn gltf(change: impl Fn(&str) -> String) -> Vec<u8> {
    use base64::Engine;
    let numbers: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    let indices = [0u16, 1, 2].iter().flat_map(|i| i.to_le_bytes());
    let data = base64::engine::general_purpose::STANDARD.encode(numbers.into_iter().chain(indices).collect::<Vec<_>>());
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"children":[1],"translation":[5,0,0]}},{{"mesh":0,"scale":[2,2,2]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":4}}]}}],
        "accessors":[
            {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
            {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
        "buffers":[{{"byteLength":42,"uri":"data:application/octet-stream;base64,{data}"}}]}}"#
    );
    change(&text).into_bytes()
}

fn refused(result: Result<Geometry, crate::SimError>, expected: &str) {
    let error = result.and_then(|geometry| geometry.surface()).unwrap_err().to_string();
    assert!(error.contains(expected), "{error}, expected: {expected}");
}

#[test]
fn a_cube_is_read_from_obj() {
    let cube = Geometry::from_file("level.OBJ", CUBE.as_bytes()).unwrap();
    let surface = cube.surface().unwrap();
    assert_eq!((surface.vertices().len(), surface.triangles().len()), (8, 12));
    assert_eq!((surface.repairs().open_edges, surface.repairs().odd_edges), (0, 0));
}

#[test]
fn a_gltf_scene_is_read_where_its_nodes_put_it() {
    let geometry = Geometry::from_file("level.gltf", &gltf(str::to_owned)).unwrap();
    assert_eq!(geometry.vertices, [DVec3::X * 5.0, DVec3::X * 7.0, DVec3::new(5.0, 2.0, 0.0)]);
    assert_eq!(geometry.triangles, [[0, 1, 2]]);
    let mirrored = gltf(|text| text.replace("[2,2,2]", "[-2,2,2]"));
    assert_eq!(Geometry::from_gltf(&mirrored).unwrap().triangles, [[0, 2, 1]]);
}

#[test]
fn bad_files_are_refused_by_name() {
    refused(Geometry::from_file("level.stl", b""), "\"stl\" is unknown, known are obj, gltf, glb");
    refused(Geometry::from_obj(b"v 0 0 0\nv 1 0 0\nf 1 2 9\n"), "OBJ: ");
    refused(Geometry::from_obj(b"v 0 0 zero\n"), "OBJ: ");
    refused(Geometry::from_obj(b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "vertex 0: position is NaN");
    refused(Geometry::from_obj(b""), "vertices is 0");
    refused(Geometry::from_gltf(b"{}"), "glTF: ");
    refused(
        Geometry::from_gltf(&gltf(|text| text.replace("data:", "file:"))),
        "buffer 0: its bytes are in another file",
    );
    refused(Geometry::from_gltf(&gltf(|text| text.replace(";base64,", ";base64,*"))), "its base64 cannot be read");
    refused(
        Geometry::from_gltf(&gltf(|text| {
            text.replace("\"count\":3,\"type\":\"VEC3\"", "\"count\":400000000,\"type\":\"VEC3\"")
        })),
        "mesh 0: accessor 0",
    );
    refused(
        Geometry::from_gltf(&gltf(|text| text.replace("\"mode\":4", "\"mode\":1"))),
        "mesh 0: it is made of something else",
    );
    let circle = gltf(|text| text.replace("\"mesh\":0,\"scale\"", "\"children\":[0],\"mesh\":0,\"scale\""));
    assert!(Geometry::from_gltf(&circle).is_err());
}

/// A block with a notch becomes hulls that have its volume, and not that of its own hull.
#[test]
fn what_is_hollow_becomes_convex_parts() {
    let outline = [(0., 0.), (3., 0.), (3., 2.), (2., 2.), (2., 1.), (1., 1.), (1., 2.), (0., 2.)];
    let mut geometry = Geometry::default();
    for z in [0.0, 1.0] {
        geometry.vertices.extend(outline.map(|(x, y)| DVec3::new(x, y, z)));
    }
    let n = outline.len() as u32;
    for i in 0..n {
        let j = (i + 1) % n;
        geometry.triangles.extend([[i, j, i + n], [j, j + n, i + n]]);
    }
    for [a, b, c] in [[0, 1, 4], [1, 2, 3], [1, 3, 4], [0, 4, 5], [0, 5, 7], [5, 6, 7]] {
        geometry.triangles.extend([[a, c, b], [a + n, b + n, c + n]]);
    }
    let repairs = geometry.surface().unwrap().repairs();
    assert_eq!((repairs.open_edges, repairs.odd_edges), (0, 0), "{repairs}");
    let desc = ConvexPartsDesc { resolution: 96, ..ConvexPartsDesc::default() };
    let parts = geometry.convex_parts(&desc).unwrap();
    let volume = |shape: &Shape| shape.mass_properties(Density::constant(1.0)).unwrap().mass;
    let sum: f64 = parts.iter().map(volume).sum();
    // Cells of 3 cm that the surface passes through belong to it.
    assert!(parts.len() > 1 && (4.9..5.8).contains(&sum), "{} parts of {sum} m³", parts.len());
    let bad = ConvexPartsDesc { resolution: 100_000, ..ConvexPartsDesc::default() };
    assert!(geometry.convex_parts(&bad).unwrap_err().to_string().contains("resolution is 100000"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Whatever the bytes, there is geometry or an error.
    #[test]
    fn random_bytes_hurt_nobody(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = Geometry::from_obj(&bytes).and_then(|geometry| geometry.surface());
        let _ = Geometry::from_gltf(&bytes).and_then(|geometry| geometry.surface());
        let mut binary = b"glTF\x02\x00\x00\x00".to_vec();
        binary.extend((12 + bytes.len() as u32).to_le_bytes());
        binary.extend(&bytes);
        let _ = Geometry::from_gltf(&binary);
    }

    /// Nor do good files in which something was changed.
    #[test]
    fn files_with_changes_hurt_nobody(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        lines in prop::collection::vec("(v|f|o|g|usemtl|vt|l|p)( -?[0-9]{1,10}(/-?[0-9]{1,3})?){0,6}", 0..20),
    ) {
        for (good, is_obj) in [(CUBE.as_bytes().to_vec(), true), (gltf(str::to_owned), false)] {
            let mut bytes = good;
            for (place, byte) in &changes {
                let place = place.index(bytes.len());
                bytes[place] = *byte;
            }
            let geometry = if is_obj { Geometry::from_obj(&bytes) } else { Geometry::from_gltf(&bytes) };
            let _ = geometry.and_then(|geometry| geometry.surface());
        }
        let _ = Geometry::from_obj(lines.join("\n").as_bytes()).and_then(|geometry| geometry.surface());
    }

    /// Any numbers as vertices and triangles are a surface or an error.
    #[test]
    fn any_numbers_are_a_surface_or_an_error(
        vertices in prop::collection::vec(prop::array::uniform3(any::<f64>()), 0..20),
        triangles in prop::collection::vec(prop::array::uniform3(0..24u32), 0..40),
    ) {
        let geometry = Geometry { vertices: vertices.into_iter().map(DVec3::from_array).collect(), triangles };
        let _ = geometry.surface();
    }
}
