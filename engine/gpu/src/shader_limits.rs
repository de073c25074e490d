//! What is looked at before a driver sees a shader: that it fits the device's limits, and that its code is whole.

use crate::info::Limits;
use mica_graph::{BindingKind, Shader, Stages};

/// Why a shader does not fit a device, if it does not. Drivers take such a shader without a word.
pub(crate) fn exceeded(shader: &Shader, limits: &Limits) -> Option<String> {
    let invocations = shader.group.iter().product();
    let of_shader = [
        (shader.params_bytes, limits.max_push_constants_bytes, "bytes of push constants", "maxPushConstantsSize"),
        (invocations, limits.max_group_invocations, "invocations in a group", "maxComputeWorkGroupInvocations"),
    ];
    let seen = |stage: Stages, kind: BindingKind| {
        let is = |binding: &&mica_graph::Binding| binding.kind == kind && binding.stages.contains(stage);
        shader.bindings.iter().filter(is).count() as u32
    };
    let of_stages = [Stages::COMPUTE, Stages::VERTEX, Stages::FRAGMENT].into_iter().flat_map(|stage| {
        [
            (
                seen(stage, BindingKind::StorageBuffer),
                limits.max_stage_storage_buffers,
                "storage buffers in a stage",
                "maxPerStageDescriptorStorageBuffers",
            ),
            (
                seen(stage, BindingKind::StorageImage),
                limits.max_stage_storage_images,
                "storage images in a stage",
                "maxPerStageDescriptorStorageImages",
            ),
            (
                seen(stage, BindingKind::SampledImage),
                limits.max_stage_sampled_images,
                "sampled images in a stage",
                "maxPerStageDescriptorSampledImages",
            ),
        ]
    });
    let mut all = of_shader.into_iter().chain(of_stages);
    let (count, most, what, name) = all.find(|(count, most, ..)| count > most)?;
    Some(format!("{count} {what} are more than {name} of this device, {most}"))
}

/// Whether SPIR-V begins with its header, consists of whole instructions, and ends with the end of a function (Khronos,
/// SPIR-V specification, section 2.3: physical layout).
pub(crate) fn is_whole(code: &[u32]) -> bool {
    const MAGIC: u32 = 0x0723_0203;
    const FUNCTION_END: u32 = 1 << 16 | 56;
    let [MAGIC, _version, _generator, bound, 0, instructions @ ..] = code else { return false };
    let (mut rest, mut last) = (instructions, instructions);
    while let Some(first) = rest.first() {
        let words = (first >> 16) as usize;
        if words == 0 || words > rest.len() {
            return false;
        }
        (last, rest) = rest.split_at(words);
    }
    *bound > 0 && last == [FUNCTION_END]
}

#[cfg(test)]
mod tests {
    use super::is_whole;

    /// A header, OpCapability Shader, and an end.
    const CODE: [u32; 8] = [0x0723_0203, 0x0001_0600, 0, 9, 0, 2 << 16 | 17, 1, 1 << 16 | 56];

    #[test]
    fn f27_code_cut_anywhere_or_with_its_layout_damaged_is_seen() {
        assert!(is_whole(&CODE));
        for words in 0..CODE.len() {
            assert!(!is_whole(&CODE[..words]), "{words} words");
        }
        // Every bit of the magic number, of the schema, and of lengths.
        let lengths = [5, 7].into_iter().flat_map(|word| (16..32).map(move |bit| (word, bit)));
        let header = [0, 4].into_iter().flat_map(|word| (0..32).map(move |bit| (word, bit)));
        for (word, bit) in header.chain(lengths) {
            let mut damaged = CODE;
            damaged[word] ^= 1 << bit;
            assert!(!is_whole(&damaged), "bit {bit} of word {word}");
        }
    }
}
