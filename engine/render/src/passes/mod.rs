//! The passes of a frame, one file each: functions from handles to handles.

pub(crate) mod accumulate;
pub(crate) mod base;
pub(crate) mod blur;
pub(crate) mod composite;
pub(crate) mod environment;
pub(crate) mod glint_tiles;
pub(crate) mod occlusion;
pub(crate) mod shadows;
pub(crate) mod surface;
pub(crate) mod tonemap;
pub(crate) mod trace;
pub(crate) mod visibility;

pub(crate) use glint_tiles::GlintTiles;
pub(crate) use surface::GBuffer;
