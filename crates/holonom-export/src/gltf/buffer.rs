//! The binary part of a file and the accessors to it.

use serde_json::{Value, json};

/// What a vertex attribute or an index is stored for.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
/// Types of components.
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// Numbers of one accessor after the other, each aligned to four bytes.
#[derive(Debug)]
pub(super) struct Buffer {
    pub(super) bytes: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
    /// Whether no number is NaN or infinite.
    pub(super) finite: bool,
}

impl Default for Buffer {
    fn default() -> Self {
        Self { bytes: Vec::new(), views: Vec::new(), accessors: Vec::new(), finite: true }
    }
}

impl Buffer {
    fn add(&mut self, bytes: &[u8], target: Option<u32>, mut accessor: Value) -> usize {
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        accessor["bufferView"] = json!(self.views.len());
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(
        &mut self,
        kind: &str,
        values: &[[f32; N]],
        target: Option<u32>,
        bounds: bool,
    ) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.finite &= values.iter().flatten().all(|v| v.is_finite());
        let mut accessor = json!({ "componentType": FLOAT, "count": values.len(), "type": kind });
        if bounds {
            let bound = |pick: fn(f32, f32) -> f32, from: f32| -> Vec<f32> {
                (0..N).map(|k| values.iter().map(|v| v[k]).fold(from, pick)).collect()
            };
            accessor["min"] = json!(bound(f32::min, f32::INFINITY));
            accessor["max"] = json!(bound(f32::max, f32::NEG_INFINITY));
        }
        self.add(&bytes, target, accessor)
    }

    /// Positions of corners.
    pub(super) fn positions(&mut self, values: &[[f32; 3]]) -> usize {
        self.floats("VEC3", values, Some(VERTICES), true)
    }

    /// Normals at corners.
    pub(super) fn normals(&mut self, values: &[[f32; 3]]) -> usize {
        self.floats("VEC3", values, Some(VERTICES), false)
    }

    /// Weights of joints at corners.
    pub(super) fn weights(&mut self, values: &[[f32; 4]]) -> usize {
        self.floats("VEC4", values, Some(VERTICES), false)
    }

    /// Joints of corners.
    pub(super) fn joints(&mut self, values: &[[u8; 4]]) -> usize {
        let accessor =
            json!({ "componentType": UNSIGNED_BYTE, "count": values.len(), "type": "VEC4" });
        self.add(values.as_flattened(), Some(VERTICES), accessor)
    }

    /// Corners of triangles.
    pub(super) fn triangles(&mut self, values: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let count = 3 * values.len();
        let accessor = json!({ "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR" });
        self.add(&bytes, Some(INDICES), accessor)
    }

    /// Times of an animation.
    pub(super) fn times(&mut self, values: &[f32]) -> usize {
        let values: Vec<[f32; 1]> = values.iter().map(|t| [*t]).collect();
        self.floats("SCALAR", &values, None, true)
    }

    /// Translations or scales of an animation.
    pub(super) fn vectors(&mut self, values: &[[f32; 3]]) -> usize {
        self.floats("VEC3", values, None, false)
    }

    /// Rotations of an animation.
    pub(super) fn rotations(&mut self, values: &[[f32; 4]]) -> usize {
        self.floats("VEC4", values, None, false)
    }

    /// Matrices, column after column.
    pub(super) fn matrices(&mut self, values: &[[f32; 16]]) -> usize {
        self.floats("MAT4", values, None, false)
    }
}
