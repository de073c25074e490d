//! Occlusion: the hierarchy as the host builds it, and both bodies as a program has them, which answer alike and as f64
//! does.

mod agreement;
mod alpha_masks;
mod bodies;
mod bvh_tracer;
mod compare;
mod driver_inverse;
mod hard_shapes;
mod leaving_surfaces;
mod mesh_hierarchy;
mod meshes;
mod random;
mod ray_spans;
mod ray_steps;
mod rays;
mod scene_hierarchy;
mod scenes;
mod seams;
mod truth;
