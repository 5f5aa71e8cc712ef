//! Smoothed states of a long log, kept in a temporary file: reading them again is faster than smoothing again.

use std::sync::OnceLock;

use tipwatch_mechanics::StateColumns;
use tipwatch_mechanics::state::Reasons;

use crate::base::scratch_file::ScratchFile;
use crate::base::state_source::EstimatedStates;

/// The blocks that were smoothed so far. Without a file, none are kept.
#[derive(Debug)]
pub(super) struct KeptBlocks {
    file: Option<ScratchFile>,
    /// Length of the file for each block (bytes).
    block_bytes: u64,
    blocks: Vec<OnceLock<Block>>,
}

/// What is in memory of a block.
#[derive(Debug)]
struct Block {
    reasons: Vec<Reasons>,
    /// Of each column, the number of all of its rows if they have the same one, to the bit: most of what no sensor
    /// measures. The other columns are in the file, tile by tile.
    constants: Vec<Option<f64>>,
}

impl KeptBlocks {
    /// Room for `blocks` of at most `rows` rows.
    pub(super) fn new(blocks: usize, rows: usize, columns: usize) -> Self {
        Self {
            // smoothing again costs time, and nothing else
            file: ScratchFile::new().ok(),
            block_bytes: (rows.next_multiple_of(StateColumns::TILE) * columns * size_of::<f64>())
                as u64,
            blocks: (0..blocks).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Keeps a block, unless it is kept already or cannot be written.
    pub(super) fn keep(&self, block: usize, states: &StateColumns, reasons: &[Reasons]) {
        let (Some(file), None) = (&self.file, self.blocks[block].get()) else {
            return;
        };
        let (constants, varying) = states.constant_and_varying();
        let place = block as u64 * self.block_bytes;
        if (file.write_at(bytemuck::cast_slice(&varying), place)).is_err() {
            return;
        }
        // whoever kept it meanwhile wrote the same bytes
        let _ = self.blocks[block].set(Block {
            reasons: reasons.to_vec(),
            constants,
        });
    }

    /// A block; `None` if it is not kept, or cannot be read.
    pub(super) fn read(&self, block: usize) -> Option<EstimatedStates> {
        let (file, kept) = (self.file.as_ref()?, self.blocks[block].get()?);
        let rows = kept.reasons.len();
        let varying = kept.constants.iter().filter(|c| c.is_none()).count();
        let mut varying =
            vec![[0.0; StateColumns::TILE]; varying * rows.div_ceil(StateColumns::TILE)];
        let place = block as u64 * self.block_bytes;
        (file.read_at(bytemuck::cast_slice_mut(&mut varying), place)).ok()?;
        let states = StateColumns::of_constant_and_varying(rows, &kept.constants, &varying);
        Some(EstimatedStates {
            states,
            reasons: kept.reasons.clone(),
        })
    }
}
