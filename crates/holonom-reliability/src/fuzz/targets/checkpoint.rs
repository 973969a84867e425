//! Checkpoints: bytes that were changed are refused. Half of the inputs are sealed again, so that
//! what stands in them is read.

use super::sample_run::{checkpoint, model, state};
use super::{Answer, FuzzTarget, Worker};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use holonom::output::Checkpoint;

/// Checkpoints.
#[derive(Clone, Copy, Debug)]
pub struct CheckpointFile;

/// Bytes before the payload; where its length and the checksum stand.
const HEAD: usize = 36;

impl FuzzTarget for CheckpointFile {
    fn name(&self) -> &'static str {
        "checkpoint"
    }

    fn executions(&self) -> u64 {
        2_000_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let all = || -> Result<Vec<Vec<u8>>, String> {
            let model = model()?;
            [0, 1, 3].iter().map(|steps| checkpoint(&model, state(&model, *steps)?)).collect()
        };
        all().unwrap_or_default()
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        let mut out = mutate::bytes(input, other, draw);
        if draw.chance(0.5) {
            seal(&mut out);
        }
        out
    }

    fn worker(&self) -> Box<dyn Worker> {
        let text = model().map(|model| model.to_toml()).unwrap_or_default();
        Box::new(Decoder { text, originals: self.seeds() })
    }
}

struct Decoder {
    text: String,
    originals: Vec<Vec<u8>>,
}

impl Worker for Decoder {
    fn execute(&mut self, input: &[u8]) -> Answer {
        let sealed = is_sealed(input) || self.originals.iter().any(|own| own == input);
        match Checkpoint::decode(input, &self.text) {
            Ok(_) if sealed => Answer::Accepted,
            Ok(_) => Answer::Wrong("a damaged checkpoint is accepted".into()),
            Err(error) => Answer::Refused(error.to_string()),
        }
    }

    /// As if the checksum were not compared.
    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        let mut sealed = input.to_vec();
        seal(&mut sealed);
        match Checkpoint::decode(&sealed, &self.text) {
            Ok(_) if is_sealed(input) => Answer::Accepted,
            Ok(_) => Answer::Wrong("a damaged checkpoint is accepted".into()),
            Err(error) => Answer::Refused(error.to_string()),
        }
    }
}

/// The FNV-1a hash of the head and the payload.
fn checksum(bytes: &[u8]) -> u64 {
    let add = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
    let (head, payload) = (bytes.get(..28), bytes.get(HEAD..));
    head.into_iter().chain(payload).flatten().fold(0xcbf2_9ce4_8422_2325, add)
}

/// Whether length and checksum are right.
fn is_sealed(bytes: &[u8]) -> bool {
    let mut again = bytes.to_vec();
    seal(&mut again);
    bytes.len() >= HEAD && again == bytes
}

/// Writes length and checksum.
fn seal(bytes: &mut [u8]) {
    if bytes.len() < HEAD {
        return;
    }
    let length = (bytes.len() - HEAD) as u64;
    bytes[20..28].copy_from_slice(&length.to_le_bytes());
    let sum = checksum(bytes);
    bytes[28..HEAD].copy_from_slice(&sum.to_le_bytes());
}
