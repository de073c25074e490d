//! One file a scene.

pub mod car;
pub mod cloth;
pub mod dress;
pub mod plane;
pub mod shoe;
pub mod snow;
pub mod sphere;
