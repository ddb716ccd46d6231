//! What must hold of a specification before a model can be made of it.

use crate::fluid::head::MOST_EDGES;
use crate::model::ModelError;
use crate::model::specification::{
    ContactMethodSpecification, ContactSpecification, FluidModelSpecification, Specification, WallSpecification,
};

fn expect(field: &'static str, length: usize, expected: usize) -> Result<(), ModelError> {
    if length == expected { Ok(()) } else { Err(ModelError::Length { field, length, expected }) }
}

/// An error if arrays do not fit together, or values are out of range.
pub(super) fn check(specification: &Specification) -> Result<(), ModelError> {
    let (nodes, edges, hinges) = (specification.nodes.len(), specification.edges.len(), specification.hinges.len());
    if edges == 0 {
        return Err(ModelError::Length { field: "edges", length: 0, expected: 1 });
    }
    expect("rest_nodes", specification.rest_nodes.len(), nodes)?;
    expect("theta", specification.theta.len(), edges)?;
    expect("radius", specification.radius.len(), edges)?;
    expect("density", specification.density.len(), edges)?;
    expect("stretching", specification.stretching.len(), edges)?;
    expect("bending", specification.bending.len(), hinges)?;
    expect("twisting", specification.twisting.len(), hinges)?;
    expect("natural_curvature", specification.natural_curvature.len(), hinges)?;
    expect("natural_twist", specification.natural_twist.len(), hinges)?;
    let positive = |field: &'static str, values: &[f64]| match values.iter().position(|v| !(*v > 0.0 && v.is_finite()))
    {
        Some(k) => Err(ModelError::Value { field: format!("{field}[{k}]"), value: values[k], allowed: "> 0" }),
        None => Ok(()),
    };
    positive("radius", &specification.radius)?;
    positive("stretching", &specification.stretching)?;
    positive("twisting", &specification.twisting)?;
    if !specification.reynolds.is_empty() {
        expect("reynolds", specification.reynolds.len(), nodes)?;
    }
    if let Some(head) = &specification.head
        && !(1..=MOST_EDGES).contains(&head.edges.len())
    {
        let (field, value) = ("head.edges".to_owned(), head.edges.len() as f64);
        return Err(ModelError::Value { field, value, allowed: "1 to 6 edges fixed to the head" });
    }
    check_walls(specification)?;
    for (k, ei) in specification.bending.iter().enumerate() {
        let determinant = ei[0][0] * ei[1][1] - ei[0][1] * ei[1][0];
        if !(ei[0][0] > 0.0 && determinant > 0.0 && ei[0][1] == ei[1][0]) {
            return Err(ModelError::Value {
                field: format!("bending[{k}]"),
                value: determinant,
                allowed: "symmetric and positive definite",
            });
        }
    }
    Ok(())
}

fn check_walls(specification: &Specification) -> Result<(), ModelError> {
    let count = specification.walls.len();
    let felt = specification.walls.iter().filter_map(WallSpecification::boundary).count();
    let spillmann =
        |contact: &ContactSpecification| matches!(contact.method, ContactMethodSpecification::SpillmannTeschner { .. });
    let allowed = match specification.fluid.as_ref().map(|fluid| &fluid.model) {
        Some(FluidModelSpecification::ResistiveForce { .. }) if felt > 0 => {
            "none that the fluid feels, with resistive force theory"
        }
        Some(_) if felt > 0 && specification.head.as_ref().is_some_and(|head| head.translation > 0.0) => {
            "none that the fluid feels, with a point head, which stirs no flow"
        }
        Some(_) if felt > 1 => "at most one that the fluid feels",
        _ if count > 0 && specification.contact.as_ref().is_some_and(spillmann) => "none, with this contact method",
        _ => return Ok(()),
    };
    Err(ModelError::Value { field: "walls".to_owned(), value: count as f64, allowed })
}
