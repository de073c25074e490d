//! What a frame must hold before it can be planned, and what is said when it does not.

use crate::declare::{Graph, Pass, Use, Work};
use crate::resource::{Description, Extent, Lifetime};
use crate::shader::Slot;
use std::collections::BTreeSet;
use std::error::Error;
use std::fmt;

/// A frame that cannot be planned. Each names the resource, and the pass where there is one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PlanError {
    /// A pass reads a resource of [`Lifetime::Frame`] that no pass before it wrote: its content is undefined.
    ReadBeforeWrite {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
    },
    /// An exported resource of [`Lifetime::Frame`] that no pass writes.
    ExportNeverWritten {
        /// The resource.
        resource: String,
    },
    /// A pass uses one resource twice, and at least one of the uses writes: no order is defined within a pass.
    UsedTwice {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
    },
    /// An attachment and the pass that draws into it differ in size.
    AttachmentExtent {
        /// The pass.
        pass: String,
        /// The attachment.
        resource: String,
        /// Its size.
        attachment: Extent,
        /// The size the pass draws.
        drawn: Extent,
    },
    /// A buffer is attached as a colour or depth image, or a pass that does not draw has an attachment.
    NotAnAttachment {
        /// The pass.
        pass: String,
        /// The resource.
        resource: String,
    },
    /// A resource without a single byte.
    ZeroSize {
        /// The pass that uses it first.
        pass: String,
        /// The resource.
        resource: String,
    },
    /// The resources of the frame do not fit into 64-bit offsets.
    TooLarge {
        /// The resource that did not fit any more.
        resource: String,
    },
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadBeforeWrite { pass, resource } => {
                write!(f, "pass {pass} reads {resource}, which no pass before it writes: write it first in this frame")
            }
            Self::ExportNeverWritten { resource } => {
                write!(f, "{resource} is exported but no pass writes it: write it, or do not export it")
            }
            Self::UsedTwice { pass, resource } => {
                write!(f, "pass {pass} uses {resource} twice and writes it: give one of the uses a resource of its own")
            }
            Self::AttachmentExtent { pass, resource, attachment, drawn } => {
                write!(f, "pass {pass} draws {drawn} into {resource}, which is {attachment}: make them equal")
            }
            Self::NotAnAttachment { pass, resource } => {
                write!(
                    f,
                    "pass {pass} cannot draw into {resource}: only a raster pass has attachments, and only images"
                )
            }
            Self::ZeroSize { pass, resource } => {
                write!(f, "pass {pass} uses {resource}, which has no bytes: give it a size of at least one")
            }
            Self::TooLarge { resource } => {
                write!(f, "{resource} does not fit into the memory of the frame: make the frame's resources smaller")
            }
        }
    }
}

impl Error for PlanError {}

/// Checks all passes as declared, also those that culling would remove: a mistake is one in every frame.
pub(crate) fn check(graph: &Graph) -> Result<(), PlanError> {
    let mut written = BTreeSet::new();
    for pass in &graph.passes {
        for (index, used) in pass.uses.iter().enumerate() {
            check_size(pass, used)?;
            check_attachment(pass, used)?;
            let names = || (pass.name.clone(), used.resource.name.clone());
            let again = |other: &Use| other.resource.id == used.resource.id;
            let writes = |other: &Use| other.access.writes() || used.access.writes();
            if pass.uses[..index].iter().any(|other| again(other) && writes(other)) {
                let (pass, resource) = names();
                return Err(PlanError::UsedTwice { pass, resource });
            }
            let undefined = used.resource.lifetime == Lifetime::Frame && !written.contains(&used.resource.id);
            if undefined && used.access.reads() {
                let (pass, resource) = names();
                return Err(PlanError::ReadBeforeWrite { pass, resource });
            }
        }
        written.extend(pass.uses.iter().filter(|used| used.access.writes()).map(|used| used.resource.id));
    }
    for resource in &graph.exports {
        if resource.lifetime == Lifetime::Frame && !written.contains(&resource.id) {
            return Err(PlanError::ExportNeverWritten { resource: resource.name.clone() });
        }
    }
    Ok(())
}

fn check_size(pass: &Pass, used: &Use) -> Result<(), PlanError> {
    if used.resource.bytes() == 0 {
        return Err(PlanError::ZeroSize { pass: pass.name.clone(), resource: used.resource.name.clone() });
    }
    Ok(())
}

fn check_attachment(pass: &Pass, used: &Use) -> Result<(), PlanError> {
    if !matches!(used.slot, Slot::Color(_) | Slot::Depth) {
        return Ok(());
    }
    let (Work::Raster { extent, .. }, Description::Image(image)) = (&pass.work, &used.resource.description) else {
        return Err(PlanError::NotAnAttachment { pass: pass.name.clone(), resource: used.resource.name.clone() });
    };
    if image.extent != *extent {
        return Err(PlanError::AttachmentExtent {
            pass: pass.name.clone(),
            resource: used.resource.name.clone(),
            attachment: image.extent,
            drawn: *extent,
        });
    }
    Ok(())
}
