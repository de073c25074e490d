//! Makes the embedded scenes: every shape, colour and light in them is a formula here.

pub mod glb;
pub mod maths;
pub mod parts;
pub mod surface;
pub mod unwrap;

mod drape;
mod scenes;

use glb::Document;

/// What makes a scene.
pub type MakeScene = fn() -> Document;

/// Every embedded scene, its file's stem and what makes it, in the order in which they are listed to people.
pub const SCENES: [(&str, MakeScene); 7] = [
    ("shoe", scenes::shoe::scene),
    ("snow", scenes::snow::scene),
    ("cloth", scenes::cloth::scene),
    ("dress", scenes::dress::scene),
    ("car", scenes::car::scene),
    ("plane", scenes::plane::scene),
    ("sphere", scenes::sphere::scene),
];
