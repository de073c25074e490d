//! Occlusion: the hierarchy as the host builds it, and both bodies as a program has them, which answer alike and as f64
//! does.

mod agreement;
mod build;
mod changed;
mod compare;
mod device;
mod driver;
mod leaving;
mod masked;
mod meshes;
mod rays;
mod scenes;
mod seams;
mod shapes;
mod spans;
mod truth;
