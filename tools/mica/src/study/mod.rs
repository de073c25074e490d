//! A study: every method with every rung of its ladder at every place, its error and its time, kept line by line.

mod effort;
mod left_out;
mod measure;
mod path;
mod pixels;
mod place;
mod plan;
mod reference;
pub mod reference_file;
mod run;
mod sittings;
mod store;
mod tables;
mod timing;

pub use effort::Effort;
pub use left_out::LeftOut;
pub use measure::{measure, shell_word, unmeasured};
pub use place::{Lighting, OpenPlace, machine};
pub use plan::{Stop, rungs, stops};
pub use reference::{Reference, ReferencePixels, path_frames};
pub use run::study;
pub use sittings::sit_again;
pub use store::{Folder, Lines};
pub use tables::of_place as table_of;
pub use timing::{Clock, paired, spread};
