//! One shader from what its stages declare.

use super::layout::Struct;
use super::reflect::{Binding, Complaint, Reflection, Stage, Varying, snake_case};

/// A binding and the stages that use it.
#[derive(Clone, Debug)]
pub struct Bound {
    /// The binding.
    pub binding: Binding,
    /// The stages.
    pub stages: Vec<Stage>,
}

/// What a whole shader declares.
#[derive(Debug)]
pub struct Interface {
    /// Bindings by slot.
    pub bindings: Vec<Bound>,
    /// The push-constant block.
    pub params: Option<Struct>,
    /// Invocations in a group; 1, 1, 1 of raster shaders.
    pub group: [u32; 3],
    /// Outputs of the fragment stage by location.
    pub outputs: Vec<Varying>,
    /// Whether it draws.
    pub raster: bool,
    /// A bit for each effect that its code asks about.
    pub effects: u32,
}

/// Joins the stages of a shader.
///
/// # Errors
/// Everything in which the stages disagree.
pub fn merge(stages: &[(Stage, &Reflection)]) -> Result<Interface, Vec<Complaint>> {
    let mut complaints = Vec::new();
    let mut interface = Interface {
        bindings: Vec::new(),
        params: None,
        group: [1; 3],
        outputs: Vec::new(),
        raster: stages.iter().any(|(stage, _)| *stage != Stage::Compute),
        effects: stages.iter().flat_map(|(_, found)| &found.effects).fold(0, |all, (_, number)| all | 1 << number),
    };
    for (stage, reflection) in stages {
        for binding in &reflection.bindings {
            add_binding(&mut interface.bindings, *stage, binding, &mut complaints);
        }
        match (&interface.params, &reflection.params) {
            (Some(vertex), Some(fragment)) if !vertex.agrees_with(fragment) => {
                let message = "the push constants differ between the stages: declare one block in an include";
                complaints.push(Complaint::new(&fragment.name, message));
            }
            (None, Some(params)) => interface.params = Some(params.clone()),
            _ => {}
        }
        match stage {
            Stage::Compute => interface.group = reflection.group,
            Stage::Vertex => {}
            Stage::Fragment => interface.outputs.clone_from(&reflection.outputs),
        }
    }
    interface.bindings.sort_by_key(|bound| bound.binding.slot);
    let stage = |wanted| stages.iter().find(|(stage, _)| *stage == wanted).map(|(_, reflection)| reflection);
    if let (Some(vertex), Some(fragment)) = (stage(Stage::Vertex), stage(Stage::Fragment)) {
        complaints.extend(fragment.inputs.iter().filter_map(|input| unfed(input, &vertex.outputs)));
    }
    complaints.extend(twice_named(&interface));
    if complaints.is_empty() { Ok(interface) } else { Err(complaints) }
}

fn add_binding(bindings: &mut Vec<Bound>, stage: Stage, binding: &Binding, complaints: &mut Vec<Complaint>) {
    let Some(known) = bindings.iter_mut().find(|known| known.binding.slot == binding.slot) else {
        bindings.push(Bound { binding: binding.clone(), stages: vec![stage] });
        return;
    };
    if known.binding.agrees_with(binding) {
        known.stages.push(stage);
        return;
    }
    let (name, slot) = (&binding.name, binding.slot);
    let message = format!("`{name}` has binding = {slot}, which the vertex stage declares otherwise");
    complaints.push(Complaint::new(&binding.declared, message));
}

/// A complaint about an input of the fragment stage that the vertex stage does not write.
fn unfed(input: &Varying, outputs: &[Varying]) -> Option<Complaint> {
    let (name, location) = (&input.name, input.location);
    let message = match outputs.iter().find(|output| output.location == location) {
        None => format!("the vertex stage writes nothing to location = {location}, which `{name}` reads"),
        Some(output) if output.ty != input.ty => {
            format!("`{name}` is {}, and the vertex stage writes {} to location = {location}", input.ty, output.ty)
        }
        Some(_) => return None,
    };
    Some(Complaint::new(name, message))
}

/// Complaints about names that would make two fields of one `Bind`.
fn twice_named(interface: &Interface) -> Vec<Complaint> {
    let bindings = interface.bindings.iter().map(|bound| (&bound.binding.name, &bound.binding.declared));
    let outputs = interface.outputs.iter().map(|output| (&output.name, &output.name));
    let mut known: Vec<String> = if interface.raster { vec!["depth".to_owned()] } else { Vec::new() };
    let mut complaints = Vec::new();
    for (name, declared) in bindings.chain(outputs) {
        let field = snake_case(name);
        if known.contains(&field) {
            let message = if field == "depth" && interface.raster {
                "`depth` is the depth attachment of every raster shader: choose another name".to_owned()
            } else {
                format!("`{name}` would be the second field `{field}` of Bind: choose another name")
            };
            complaints.push(Complaint::new(declared, message));
        } else {
            known.push(field);
        }
    }
    complaints
}
