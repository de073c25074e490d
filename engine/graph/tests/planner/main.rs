//! Plans, examined without a GPU: random frames against plain simulators, broken plans, and small frames by hand.

mod broken_plans;
mod by_hand;
mod contents;
mod errors;
mod frames;
mod printed;
mod random;
mod random_frames;
mod rules;
mod shaders;
