//! Shaders without code: what a planner sees of them.

use mica_graph::{Access, Bind, Buffer, Effects, Image, Resource, Shader, Slot, Stages};
use std::sync::Arc;

/// Stands for every compute shader.
pub static COMPUTE: Shader = shader("compute", [8, 8, 1]);
/// Stands for every raster shader.
pub static RASTER: Shader = shader("raster", [1, 1, 1]);

const fn shader(name: &'static str, group: [u32; 3]) -> Shader {
    Shader {
        name,
        variant: "",
        stages: &[],
        group,
        bindings: &[],
        params_bytes: 0,
        outputs: &[],
        effects: Effects::NONE,
    }
}

/// A compute shader's images.
pub struct Compute<'a> {
    pub reads: Vec<&'a Image>,
    pub writes: Vec<&'a mut Image>,
}

impl Bind for Compute<'_> {
    const SHADER: &'static Shader = &COMPUTE;
    type Params = ();

    fn visit(&self, visit: &mut dyn FnMut(&Arc<Resource>, Slot, Access, Stages)) {
        for (slot, image) in (0..).zip(&self.reads) {
            visit(image.resource(), Slot::Binding(slot), Access::Sampled, Stages::COMPUTE);
        }
        for (slot, image) in (self.reads.len() as u32..).zip(&self.writes) {
            visit(image.resource(), Slot::Binding(slot), Access::StorageWrite, Stages::COMPUTE);
        }
    }

    fn params_bytes(_: &()) -> Vec<u8> {
        Vec::new()
    }
}

/// A raster shader that pulls its vertices from a buffer.
pub struct Raster<'a> {
    pub mesh: &'a Buffer,
    pub color: &'a mut Image,
    pub depth: &'a mut Image,
}

impl Bind for Raster<'_> {
    const SHADER: &'static Shader = &RASTER;
    type Params = ();

    fn visit(&self, visit: &mut dyn FnMut(&Arc<Resource>, Slot, Access, Stages)) {
        visit(self.mesh.resource(), Slot::Binding(0), Access::StorageRead, Stages::VERTEX);
        visit(self.color.resource(), Slot::Color(0), Access::ColorWrite, Stages::COLOR_OUTPUT);
        visit(self.depth.resource(), Slot::Depth, Access::DepthWrite, Stages::DEPTH_TEST);
    }

    fn params_bytes(_: &()) -> Vec<u8> {
        Vec::new()
    }
}
