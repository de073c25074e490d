//! What reads files of others, given anything: one target for each format, a corpus of small files that code makes, and
//! mutations of them.
//!
//! The program of this crate runs the mutations; `fuzz/` holds the same targets for cargo-fuzz.

pub mod corpus;
mod mutation;
mod targets;

pub use mutation::input;
pub use targets::{cache, exr, glb, gltf, hdr, jpeg, png};

/// What files are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// glTF as JSON, with its data in URIs.
    Gltf,
    /// Binary glTF.
    Glb,
    /// OpenEXR environment maps.
    Exr,
    /// Radiance environment maps.
    Hdr,
    /// PNG images in scenes.
    Png,
    /// JPEG images in scenes.
    Jpeg,
    /// Entries of the cache.
    Cache,
}

impl Format {
    /// Each once.
    pub const ALL: [Format; 7] = [Self::Gltf, Self::Glb, Self::Exr, Self::Hdr, Self::Png, Self::Jpeg, Self::Cache];

    /// As it is printed, and as its files end.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gltf => "gltf",
            Self::Glb => "glb",
            Self::Exr => "exr",
            Self::Hdr => "hdr",
            Self::Png => "png",
            Self::Jpeg => "jpeg",
            Self::Cache => "cache",
        }
    }

    /// Reads bytes of the format: true where they made sense. Panics where what was read is unsound.
    pub fn read(self, bytes: &[u8]) -> bool {
        match self {
            Self::Gltf => gltf(bytes),
            Self::Glb => glb(bytes),
            Self::Exr => exr(bytes),
            Self::Hdr => hdr(bytes),
            Self::Png => png(bytes),
            Self::Jpeg => jpeg(bytes),
            Self::Cache => cache(bytes),
        }
    }

    /// The files from which mutations start.
    pub fn corpus(self) -> Vec<Vec<u8>> {
        match self {
            Self::Gltf => corpus::gltf::texts(),
            Self::Glb => corpus::gltf::binaries(),
            Self::Exr => corpus::exr::files(),
            Self::Hdr => corpus::hdr::files(),
            Self::Png => corpus::png::files(),
            Self::Jpeg => corpus::jpeg::files(),
            Self::Cache => corpus::cache::files(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_file_of_every_corpus_is_a_good_one_and_all_are_small() {
        for format in Format::ALL {
            let files = format.corpus();
            assert!(format.read(&files[0]), "{format:?}");
            assert!(files.iter().all(|file| file.len() < 4096), "{format:?}");
        }
    }

    #[test]
    fn every_corpus_of_pictures_holds_good_files_of_every_kind() {
        let read = |format: Format| format.corpus().iter().map(|file| format.read(file)).collect::<Vec<bool>>();
        let good = |format: Format| read(format).iter().filter(|good| **good).count();
        assert!(good(Format::Exr) > corpus::exr::COMPRESSIONS.len(), "{:?}", read(Format::Exr));
        assert!(good(Format::Hdr) >= 3, "{:?}", read(Format::Hdr));
        assert!(good(Format::Png) >= 8, "{:?}", read(Format::Png));
        assert!(
            good(Format::Gltf) >= 2 && good(Format::Glb) >= 2 && good(Format::Jpeg) >= 2 && good(Format::Cache) >= 2
        );
    }

    #[test]
    fn an_input_follows_from_its_seed_and_number() {
        for format in Format::ALL {
            let corpus = format.corpus();
            assert_eq!(input(format, &corpus, 1, 77), input(format, &corpus, 1, 77));
            let distinct: std::collections::BTreeSet<Vec<u8>> =
                (0..100).map(|k| input(format, &corpus, 1, k)).collect();
            assert!(distinct.len() > 80, "{format:?}: {} of 100 inputs are distinct", distinct.len());
        }
    }
}
