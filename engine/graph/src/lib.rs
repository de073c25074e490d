//! A frame, declared and planned: what should happen, and the exact steps, barriers and bytes that make it happen.
//!
//! Nothing here knows Vulkan. A [`Graph`] is declared pass by pass; [`Plan::new`] turns it into data that prints,
//! that tests examine without a GPU, and that `mica-gpu` executes.
//!
//! One rule decides every barrier and every byte: *two uses conflict when their bytes overlap and one of them writes*.
//! Images that live for one frame share memory, so a dependency between two passes and the reuse of memory by two
//! images are the same question with the same answer.
//!
//! A pass is declared with its shader's `Bind` struct, which the build derives from the GLSL; copies, fills, builds and
//! downloads need none:
//!
//! ```
//! use mica_graph::{Extent, Format, Graph, Plan, Requirements, Step};
//!
//! let size = Extent::new(64, 32);
//! let mut g = Graph::new();
//! let mut radiance = g.image("radiance", Format::Rgba16Float, size);
//! let mut history = g.image("history", Format::Rgba16Float, size);
//! let mut unused = g.image("unused", Format::Rgba8, size);
//! g.clear(&mut radiance, 0.5);
//! g.clear(&mut unused, 0.0);
//! g.copy_image(&radiance, &mut history);
//! g.export(&history);
//!
//! // What a device would answer.
//! let plan = Plan::new(g, &|resource, _| Requirements { bytes: resource.bytes(), alignment: 256 })?;
//! assert_eq!(plan.culled, ["clear unused"]);
//! let [begin, Step::Run(0), copy, Step::Run(1)] = &plan.steps[..] else { panic!("{plan}") };
//! // An image begins without content: nothing to wait for.
//! assert!(matches!(begin, Step::Synchronize { barrier, .. } if barrier.from_stages.is_empty()));
//! assert!(matches!(copy, Step::Synchronize { barrier, .. }
//!     if barrier.why == ["radiance: clear radiance writes, copy radiance reads"]));
//! # Ok::<(), mica_graph::PlanError>(())
//! ```

mod check;
mod cull;
mod declare;
mod place;
mod plan;
mod print;
mod resource;
mod shader;
mod structure;
mod synchronize;

pub use check::PlanError;
pub use declare::{Download, Draw, Graph, Over, Pass, Use, Work};
pub use plan::{Barrier, Placement, Plan, Requirements, Step, Usage};
pub use resource::{Buffer, BufferDesc, Description, Extent, Format, Image, ImageDesc, Lifetime, Resource, ResourceId};
pub use shader::{Access, Bind, Binding, BindingKind, Effects, Sampler, Shader, Slot, Stage, StageCode, Stages};
pub use structure::{MeshRange, Structure, StructureDesc, StructureInstance, TrianglesDesc};
