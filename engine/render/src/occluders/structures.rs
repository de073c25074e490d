//! Occluders as the device's own acceleration structures.

use super::{Places, is_masked};
use crate::RenderError;
use crate::scene::bvh::{Placed, Placements, check};
use crate::scene::{Mesh, Scene};
use crate::scene_buffers::{SceneBuffers, rows};
use glam::{DAffine3, Vec3};
use mica_graph::{Buffer, Graph, Lifetime, MeshRange, Structure, TrianglesDesc};
use std::collections::BTreeMap;

/// Triangles that one pass builds over, unless a single mesh has more: each build has working space of its own for the
/// length of its pass, and on GPUs that grows with its triangles.
const TRIANGLES_A_PASS: u64 = 1 << 20;

/// Graphs from a build to the copy without spare room. How much the copy takes is known only when the device has finished
/// the build, and a host may have several frames under way: by default an executor allows three. If one allows more, and
/// the size is not known yet, the copy takes as much as the original.
const GRAPHS_TO_COMPACTION: u64 = 4;

/// The triangles of a bottom level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Triangles {
    /// Of a mesh, in its own space.
    OfMesh(usize),
    /// Of an instance, in scene space: Vulkan demands transforms that have an inverse.
    OfInstance(usize),
}

impl Triangles {
    fn of(placed: &Placed) -> Self {
        if placed.in_scene_space { Self::OfInstance(placed.instance) } else { Self::OfMesh(placed.mesh) }
    }
}

/// A bottom level.
struct Bottom {
    structure: Structure,
    triangles: TrianglesDesc,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    ToBuild,
    Built { frame: u64 },
    Compacted,
}

/// The structures that `occlusion/ray_query.glsl` asks.
pub(crate) struct Structures {
    pub scene: Structure,
    placements: Placements,
    bottoms: BTreeMap<Triangles, Bottom>,
    /// Why the top level has to be built again; nothing while it stands.
    stale: Option<String>,
}

impl Structures {
    /// For a scene as it stands: nothing is built yet.
    pub fn new(scene: &Scene, buffers: &SceneBuffers, places: &Places) -> Result<Self, RenderError> {
        for mesh in &scene.meshes {
            check(&mesh.positions, &mesh.indices)?;
        }
        let placements = Placements::new(places, scene.meshes.len(), |mesh| buffers.box_corners(mesh))?;
        let top = Structure::over_instances("structure of scene", placements.list().len() as u32, Lifetime::Scene);
        let mut structures =
            Self { scene: top, placements, bottoms: BTreeMap::new(), stale: Some(super::FIRST_ASKED.to_owned()) };
        structures.hold(scene);
        Ok(structures)
    }

    /// Follows instances that moved.
    pub fn place(
        &mut self,
        scene: &Scene,
        buffers: &SceneBuffers,
        places: &Places,
        moved: &Places,
        why: String,
    ) -> Result<(), RenderError> {
        let corners_of = |mesh| buffers.box_corners(mesh);
        match self.placements.moved(moved, corners_of)? {
            Some(placements) => self.placements = placements,
            None => {
                self.placements = Placements::new(places, scene.meshes.len(), corners_of)?;
                for (instance, _) in moved {
                    self.bottoms.remove(&Triangles::OfInstance(*instance));
                }
                self.hold(scene);
            }
        }
        self.stale = Some(why);
        Ok(())
    }

    /// Keeps the bottom levels that instances are placements of, and no others.
    fn hold(&mut self, scene: &Scene) {
        let placed: BTreeMap<Triangles, usize> =
            self.placements.list().iter().map(|placed| (Triangles::of(placed), placed.mesh)).collect();
        self.bottoms.retain(|triangles, _| placed.contains_key(triangles));
        for (of, mesh) in placed {
            self.bottoms.entry(of).or_insert_with(|| Bottom::new(of, &scene.meshes[mesh], scene));
        }
    }

    /// Declares what brings them up to date in the `frame`-th graph that does.
    pub fn update(&mut self, g: &mut Graph, scene: &Scene, buffers: &SceneBuffers, frame: u64) {
        self.build(g, scene, buffers, frame);
        self.compact(g, |built| frame >= built + GRAPHS_TO_COMPACTION);
        self.build_top(g);
    }

    /// Declares the builds of the bottom levels that are to be built.
    pub fn build(&mut self, g: &mut Graph, scene: &Scene, buffers: &SceneBuffers, frame: u64) {
        if let Some(why) = &self.stale {
            g.because(why.clone());
        }
        let mut of_meshes = Vec::new();
        let mut of_instances = Vec::new();
        let mut in_scene_space: Vec<[f32; 3]> = Vec::new();
        let waiting = self.bottoms.iter_mut().filter(|(_, bottom)| bottom.state == State::ToBuild);
        for (of, Bottom { structure, triangles, state }) in waiting {
            *state = State::Built { frame };
            match *of {
                Triangles::OfMesh(mesh) => of_meshes.push((structure, *triangles, buffers.mesh_places[mesh])),
                Triangles::OfInstance(instance) => {
                    let list = self.placements.list();
                    let Ok(place) = list.binary_search_by_key(&instance, |placed| placed.instance) else { continue };
                    let Placed { mesh, scene_from_local, .. } = &list[place];
                    let first_vertex = in_scene_space.len() as u32;
                    let to_scene = |position: &[f32; 3]| {
                        scene_from_local.transform_point3(Vec3::from(*position).as_dvec3()).as_vec3().to_array()
                    };
                    in_scene_space.extend(scene.meshes[*mesh].positions.iter().map(to_scene));
                    let range = MeshRange { first_vertex, ..buffers.mesh_places[*mesh] };
                    of_instances.push((structure, *triangles, range));
                }
            }
        }
        build_in_parts(g, &buffers.indices.buffer, &buffers.positions.buffer, of_meshes);
        if !of_instances.is_empty() {
            let bytes: &[u8] = bytemuck::cast_slice(&in_scene_space);
            let mut positions = g.buffer("positions_in_scene_space", bytes.len() as u64);
            g.upload(&mut positions, bytes);
            build_in_parts(g, &buffers.indices.buffer, &positions, of_instances);
        }
    }

    /// Declares copies without spare room of the bottom levels that were built in frames that are `due`. The originals go
    /// once the frame is finished.
    pub fn compact(&mut self, g: &mut Graph, due: impl Fn(u64) -> bool) {
        g.because("how much room it needs is known since it was built");
        for Bottom { structure, state, .. } in self.bottoms.values_mut() {
            let State::Built { frame } = *state else { continue };
            if let Some(mut compacted) = Structure::compacted(structure).filter(|_| due(frame)) {
                g.compact(structure, &mut compacted);
                *structure = compacted;
                *state = State::Compacted;
                self.stale.get_or_insert_with(|| "the structures below it were compacted".to_owned());
            }
        }
    }

    /// Declares the build of the top level, if it does not stand.
    pub fn build_top(&mut self, g: &mut Graph) {
        let Some(why) = self.stale.take() else { return };
        g.because(why);
        let bottoms = &self.bottoms;
        let instances = self.placements.list().iter().filter_map(|placed| {
            let structure = &bottoms.get(&Triangles::of(placed))?.structure;
            let map = if placed.in_scene_space { DAffine3::IDENTITY } else { placed.scene_from_local };
            Some((structure, rows(&map), placed.instance as u32))
        });
        g.build_instances("build scene", instances, &mut self.scene);
    }
}

impl Bottom {
    fn new(of: Triangles, mesh: &Mesh, scene: &Scene) -> Self {
        let triangles = TrianglesDesc {
            triangles: mesh.triangle_count() as u32,
            vertices: mesh.positions.len() as u32,
            opaque: !is_masked(scene, mesh),
        };
        let name = match of {
            Triangles::OfMesh(index) => format!("structure of mesh {index}"),
            Triangles::OfInstance(index) => format!("structure of instance {index}"),
        };
        let structure = Structure::over_triangles(name, triangles, Lifetime::Scene);
        Self { structure, triangles, state: State::ToBuild }
    }
}

/// Declares builds, a bounded number of triangles in each pass.
fn build_in_parts(
    g: &mut Graph,
    indices: &Buffer,
    positions: &Buffer,
    waiting: Vec<(&mut Structure, TrianglesDesc, MeshRange)>,
) {
    let mut part = Vec::new();
    let mut triangles = 0;
    for (structure, desc, range) in waiting {
        let more = u64::from(desc.triangles);
        if !part.is_empty() && triangles + more > TRIANGLES_A_PASS {
            g.build_meshes("build meshes", indices, positions, std::mem::take(&mut part));
            triangles = 0;
        }
        triangles += more;
        part.push((structure, range));
    }
    if !part.is_empty() {
        g.build_meshes("build meshes", indices, positions, part);
    }
}
