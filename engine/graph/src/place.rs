//! Where each resource of a frame lies in the memory they share.

/// A range of bytes to be found, and the passes during which nobody else may have it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// Size in bytes.
    pub bytes: u64,
    /// Alignment of the offset.
    pub alignment: u64,
    /// First and last pass.
    pub passes: (usize, usize),
}

impl Block {
    fn meets(&self, other: &Self) -> bool {
        self.passes.0 <= other.passes.1 && other.passes.0 <= self.passes.1
    }
}

/// An offset for each block, and the end of the last.
pub(crate) struct Layout {
    pub offsets: Vec<u64>,
    pub bytes: u64,
}

/// Gives every block an offset such that two that meet in a pass share no byte; on overflow, which block did not fit.
///
/// Each block takes the lowest offset left to it, the largest block first or the earliest first, whichever ends lower.
/// Earliest first never takes more than [`side_by_side`] does, so sharing never costs memory.
pub(crate) fn share(blocks: &[Block]) -> Result<Layout, usize> {
    let mut by_size: Vec<usize> = (0..blocks.len()).collect();
    by_size.sort_by_key(|&index| (std::cmp::Reverse(blocks[index].bytes), blocks[index].passes.0));
    let by_size = share_in_order(blocks, &by_size)?;
    let by_use = share_in_order(blocks, &(0..blocks.len()).collect::<Vec<_>>())?;
    Ok(if by_use.bytes < by_size.bytes { by_use } else { by_size })
}

/// The bytes that the blocks take one after the other; on overflow, which block did not fit.
pub(crate) fn side_by_side(blocks: &[Block]) -> Result<u64, usize> {
    blocks.iter().enumerate().try_fold(0, |end, (index, block)| {
        let offset = align(end, block.alignment).ok_or(index)?;
        offset.checked_add(block.bytes).ok_or(index)
    })
}

fn share_in_order(blocks: &[Block], order: &[usize]) -> Result<Layout, usize> {
    let mut layout = Layout { offsets: vec![0; blocks.len()], bytes: 0 };
    for (done, &index) in order.iter().enumerate() {
        let block = &blocks[index];
        let mut taken: Vec<(u64, u64)> = order[..done]
            .iter()
            .filter(|&&other| block.meets(&blocks[other]))
            .map(|&other| (layout.offsets[other], layout.offsets[other] + blocks[other].bytes))
            .collect();
        taken.sort_unstable();
        let (offset, end) = lowest_gap(block, &taken).ok_or(index)?;
        layout.offsets[index] = offset;
        layout.bytes = layout.bytes.max(end);
    }
    Ok(layout)
}

/// The first range for `block` that meets none of the `taken` ranges, which are sorted by their start.
fn lowest_gap(block: &Block, taken: &[(u64, u64)]) -> Option<(u64, u64)> {
    let mut offset = 0;
    for &(start, end) in taken {
        if offset + block.bytes <= start {
            break;
        }
        offset = offset.max(align(end, block.alignment)?);
        offset.checked_add(block.bytes)?;
    }
    Some((offset, offset.checked_add(block.bytes)?))
}

fn align(offset: u64, alignment: u64) -> Option<u64> {
    offset.checked_next_multiple_of(alignment.max(1))
}
