//! Memory for the force balance at one trial; no evaluation allocates.

use crate::model::Model;
use crate::rod::configuration::{Configuration, ShaftAngle};

/// Configuration, residuals and derivative at the last trial.
pub(crate) struct Evaluation {
    pub configuration: Configuration,
    pub shafts: Vec<ShaftAngle>,
    /// Gradient of the energies, N and N m.
    pub gradient: Vec<f64>,
    /// Residual of the other terms; of all, with what is prescribed taken out, after [`Self::combine`].
    pub residual: Vec<f64>,
    /// Residual of the fluid's equation, Pa m s / m.
    pub slip: Vec<f64>,
    /// What holds the prescribed degrees of freedom, N or N m; zero elsewhere.
    pub reaction: Vec<f64>,
    /// Derivative on the model's pattern.
    pub jacobian: Vec<f64>,
}

impl Evaluation {
    /// Room for the trials of a model.
    pub fn new(model: &Model) -> Self {
        let n = model.dof_count;
        Self {
            configuration: Configuration::new(&model.network, n),
            shafts: Vec::new(),
            gradient: vec![0.0; n],
            residual: vec![0.0; n],
            slip: vec![0.0; 3 * model.storage.fluid_dofs.len()],
            reaction: vec![0.0; n],
            jacobian: vec![0.0; model.storage.pattern.entries()],
        }
    }

    /// Adds the gradient to the residual; what is left on prescribed degrees of freedom is their reaction.
    pub fn combine(&mut self, prescribed: &[bool]) {
        for (dof, &held) in prescribed.iter().enumerate() {
            let total = self.residual[dof] + self.gradient[dof];
            (self.residual[dof], self.reaction[dof]) = if held { (0.0, total) } else { (total, 0.0) };
        }
    }
}
