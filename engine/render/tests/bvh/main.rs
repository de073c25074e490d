//! The hierarchy of occlusion: as the host builds it, and as `occlusion/bvh.glsl` walks it on a device.

mod build;
mod gpu;
mod shapes;
mod trace;
mod truth;
