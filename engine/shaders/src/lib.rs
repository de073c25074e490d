//! Mica's shaders, compiled from GLSL when this crate is built, with the Rust types derived from their SPIR-V.
//!
//! GLSL declares, Rust is derived. Each `passes/NAME.comp`, and each pair `passes/NAME.vert` and `passes/NAME.frag`, is
//! one shader and gives one module `NAME` (subfolders do not count) with
//! - `SHADER`: its code, its bindings and its group size, for the executor;
//! - `Bind`: one field for each binding that its code uses, `&Image` or `&Buffer` where the GLSL says `readonly`,
//!   `texture2D` or `uniform` block, `&mut` where it may write; for raster shaders also each output and `depth`;
//! - `Params`: its push constants, or `()`.
//!
//! A pass that includes `method.glsl` is made once for each file in `methods/`, one that includes `occlusion.glsl` once
//! for each file in `occlusion/`: the module then has one for each variant, such as `wang2020` or `wang2020_bvh`. So it is
//! with `probability.glsl`, `count.glsl` and `arithmetic.glsl`, for each file in `rungs/probability/` and so on: ways to
//! compute one quantity, which `passes/exactness` measures.
//! Structs and blocks in buffers are in [`types`], the literal scalar constants of `shared/` in [`constants`], and
//! [`ALL`] lists every shader.
//!
//! Samplers are not bound: the executor supplies those called `nearest`, `linear` and `linear_wrap_u`, and there are no
//! others. `bool` members are `u32` (0 or 1), matrices arrays of columns; where GLSL leaves gaps between columns or
//! elements, the Rust arrays have four numbers instead of three, or of one.
//!
//! # What a pass looks like
//! From GLSL that declares
//! ```glsl
//! layout(binding = 0) uniform texture2D radiance;
//! layout(binding = 1, rgba8) uniform writeonly image2D display;
//! layout(binding = 2) buffer Histogram { uint bins[]; } histogram;
//! layout(push_constant) uniform Params { float exposure; };
//! ```
//! comes what this needs:
//! ```
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &radiance, display: &mut display, histogram: &mut histogram };
//! g.pass(bind, Params { exposure: 1.0 }, extent);
//! # assert_eq!(g.passes().len(), 1);
//! ```
//!
//! # What does not compile
//! Each of these differs in one place from the pass above. A binding is forgotten:
//! ```compile_fail,E0063
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &radiance, display: &mut display };
//! g.pass(bind, Params { exposure: 1.0 }, extent);
//! ```
//! A binding is misspelt:
//! ```compile_fail,E0560
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radience: &radiance, display: &mut display, histogram: &mut histogram };
//! g.pass(bind, Params { exposure: 1.0 }, extent);
//! ```
//! An image is bound for reading where the shader writes:
//! ```compile_fail,E0308
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &radiance, display: &display, histogram: &mut histogram };
//! g.pass(bind, Params { exposure: 1.0 }, extent);
//! ```
//! A buffer is bound where the shader has an image:
//! ```compile_fail,E0308
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &radiance, display: &mut histogram, histogram: &mut histogram };
//! g.pass(bind, Params { exposure: 1.0 }, extent);
//! ```
//! A parameter is of another type:
//! ```compile_fail,E0308
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &radiance, display: &mut display, histogram: &mut histogram };
//! g.pass(bind, Params { exposure: 1 }, extent);
//! ```
//! A parameter is forgotten:
//! ```compile_fail,E0063
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &radiance, display: &mut display, histogram: &mut histogram };
//! g.pass(bind, Params {}, extent);
//! ```
//! An image is read and written by one pass that does not load and store it in one binding:
//! ```compile_fail,E0502
//! # mod setting { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/examples/setting.rs")); }
//! # use setting::*;
//! # let Setting { mut g, extent, radiance, mut display, mut histogram } = setting();
//! let bind = Bind { radiance: &display, display: &mut display, histogram: &mut histogram };
//! g.pass(bind, Params { exposure: 1.0 }, extent);
//! ```

include!(concat!(env!("OUT_DIR"), "/shaders/mod.rs"));
