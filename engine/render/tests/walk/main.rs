//! What `occlusion/bvh.glsl` promises of itself: masks, steps, seams close by, and surfaces that are left.

mod host;
mod masks;
mod offset;
mod seams;
mod shapes;
mod steps;
mod trace;
mod truth;
