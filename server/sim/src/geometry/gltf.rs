//! glTF 2.0, text or binary: the triangles of every mesh of the scene, where its nodes put them.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3, Mat4};
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Node, Primitive, Semantic};

use super::{Geometry, check_size};
use crate::error::SimError;

/// Most nodes that a node may be below.
const DEPTH_MAX: usize = 64;

/// Most nodes of a scene; one that is below several others counts for each.
const NODES_MAX: usize = 10_000;

impl Geometry {
    /// Reads a glTF file whose buffers are in it: a `.glb`, or a `.gltf` with data URIs.
    ///
    /// # Errors
    /// [`SimError`] naming the mesh, node or buffer that cannot be used, and why.
    pub fn from_gltf(bytes: &[u8]) -> Result<Self, SimError> {
        check_size(bytes)?;
        let unreadable = |error| SimError::Unusable { what: "it is no glTF file" }.of(format!("glTF: {error}"));
        check_attributes(&Gltf::from_slice_without_validation(bytes).map_err(unreadable)?.document)?;
        let Gltf { document, blob } = Gltf::from_slice(bytes).map_err(unreadable)?;
        let buffers = buffers(&document, blob)?;
        let scene = document.default_scene().or_else(|| document.scenes().next());
        let scene = scene.ok_or(SimError::Unusable { what: "the file has no scene" })?;
        let mut reader = Reader { buffers, nodes: 0, geometry: Self::default() };
        scene.nodes().try_for_each(|node| reader.node(&node, DMat4::IDENTITY, 0))?;
        Ok(reader.geometry)
    }
}

/// `Err` where an attribute names no accessor: the crate's own validation looks there before it asks.
fn check_attributes(document: &Document) -> Result<(), SimError> {
    let root = document.as_json();
    for (index, mesh) in root.meshes.iter().enumerate() {
        let mut accessors = mesh.primitives.iter().flat_map(|primitive| primitive.attributes.values());
        if accessors.any(|accessor| accessor.value() >= root.accessors.len()) {
            let what = "an attribute names an accessor that does not exist";
            return Err(SimError::Unusable { what }.of(format!("mesh {index}")));
        }
    }
    Ok(())
}

/// The bytes of every buffer.
fn buffers(document: &Document, blob: Option<Vec<u8>>) -> Result<Vec<Vec<u8>>, SimError> {
    let mut blob = blob;
    let contents = document.buffers().map(|buffer| {
        let contents = match buffer.source() {
            Source::Bin => blob.take().ok_or("the file has no binary part"),
            Source::Uri(uri) => data_of(uri),
        };
        contents.map_err(|what| SimError::Unusable { what }.of(format!("buffer {}", buffer.index())))
    });
    contents.collect()
}

fn data_of(uri: &str) -> Result<Vec<u8>, &'static str> {
    let data = uri.strip_prefix("data:").ok_or("its bytes are in another file: put them into this one")?;
    let (_, data) = data.split_once(";base64,").ok_or("its data URI is not in base64")?;
    STANDARD.decode(data).map_err(|_| "its base64 cannot be read")
}

struct Reader {
    buffers: Vec<Vec<u8>>,
    nodes: usize,
    geometry: Geometry,
}

impl Reader {
    /// A node's mesh and those below it.
    fn node(&mut self, node: &Node, above: DMat4, depth: usize) -> Result<(), SimError> {
        let named = |what| SimError::Unusable { what }.of(format!("node {}", node.index()));
        self.nodes += 1;
        if depth > DEPTH_MAX {
            return Err(named("it is more than 64 nodes deep, or below itself"));
        }
        if self.nodes > NODES_MAX {
            return Err(named("it is one too many: a scene may have 10000 nodes"));
        }
        let to_world = above * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                let of_mesh = |reason: SimError| reason.of(format!("mesh {}", mesh.index()));
                self.primitive(&primitive, to_world).map_err(of_mesh)?;
            }
        }
        node.children().try_for_each(|child| self.node(&child, to_world, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive, to_world: DMat4) -> Result<(), SimError> {
        let unusable = |what| SimError::Unusable { what };
        if primitive.mode() != Mode::Triangles {
            return Err(unusable("it is made of something else than triangles"));
        }
        let positions = primitive.get(&Semantic::Positions).ok_or(unusable("it has no positions"))?;
        if (positions.data_type(), positions.dimensions()) != (DataType::F32, Dimensions::Vec3) {
            return Err(unusable("its positions are no vectors of three floats"));
        }
        let vertices = self.elements(&positions)?.map(|bytes| {
            let (numbers, _) = bytes.as_chunks::<4>();
            let number = |i: usize| f64::from(f32::from_le_bytes(numbers[i]));
            to_world.transform_point3(DVec3::new(number(0), number(1), number(2)))
        });
        let vertices: Vec<_> = vertices.collect();
        let corners: Vec<u32> = match primitive.indices() {
            None => (0..vertices.len() as u32).collect(),
            Some(indices) if indices.dimensions() == Dimensions::Scalar => {
                let numbers = self.elements(&indices)?.map(|bytes| match *bytes {
                    [a] => a.into(),
                    [a, b] => u16::from_le_bytes([a, b]).into(),
                    [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
                    _ => u32::MAX,
                });
                numbers.collect()
            }
            Some(_) => return Err(unusable("its indices are no numbers")),
        };
        let (triangles, _) = corners.as_chunks::<3>();
        // What mirrors turns triangles inside out.
        let mirrors = to_world.determinant() < 0.0;
        let triangles = triangles.iter().map(|&[a, b, c]| if mirrors { [a, c, b] } else { [a, b, c] });
        self.geometry.add(vertices.into_iter(), triangles)
    }

    /// The bytes of each of an accessor's elements.
    fn elements(&self, accessor: &Accessor) -> Result<impl Iterator<Item = &[u8]>, SimError> {
        let named = |what| SimError::Unusable { what }.of(format!("accessor {}", accessor.index()));
        let view = accessor.view().filter(|_| accessor.sparse().is_none());
        let view = view.ok_or(named("it is sparse, or empty"))?;
        let (size, count) = (accessor.size(), accessor.count());
        let stride = view.stride().unwrap_or(size).max(size);
        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], |buffer| buffer);
        let length = (count.max(1) - 1).checked_mul(stride).and_then(|length| length.checked_add(size));
        let start = view.offset().checked_add(accessor.offset());
        let end = start.zip(length).and_then(|(start, length)| start.checked_add(length));
        let bytes = start.zip(end).and_then(|(start, end)| buffer.get(start..end));
        let bytes = bytes.filter(|_| count > 0).ok_or(named("it reaches beyond its buffer, or is empty"))?;
        Ok(bytes.chunks(stride).map(move |element| &element[..size]))
    }
}
