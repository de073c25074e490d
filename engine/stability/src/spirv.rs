//! SPIR-V taken apart and written, for shaders that are changed before they run.

/// Words before the first instruction (Khronos, SPIR-V specification, section 2.3: physical layout).
pub(crate) const HEADER_WORDS: usize = 5;

/// Operation and words of each instruction.
pub(crate) fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = &words[HEADER_WORDS..];
    std::iter::from_fn(move || {
        let length = (rest.first()? >> 16) as usize;
        let (whole, after) = rest.split_at_checked(length.max(1))?;
        rest = after;
        Some((whole[0] & 0xffff, whole))
    })
}

/// Appends an instruction.
pub(crate) fn push(code: &mut Vec<u32>, operation: u32, operands: impl IntoIterator<Item = u32>) {
    let at = code.len();
    code.push(operation);
    code.extend(operands);
    let words = (code.len() - at) as u32;
    code[at] |= words << 16;
}
