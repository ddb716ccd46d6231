//! What a residual is measured by: every filament by its own forces, every degree of freedom by its own round-off, so that
//! nothing stiff, fast or heavy elsewhere hides what is left of a small force.

use crate::Mat3;
use crate::fluid::FluidModel;
use crate::model::Model;
use crate::nonlinear::equations::{Goal, Size};
use crate::step::given::Step;

/// Least force a filament is measured by, in its bending stiffness over its length squared.
const LEAST: f64 = 1e-8;

/// Targets and weights of the residual's entries.
pub(crate) struct Targets {
    goal: Goal,
    /// Round-off of every degree of freedom's force, N.
    floor: Vec<f64>,
    /// By filament, largest force other than elastic ones, N: they balance these, and may be far too large in a guess.
    force: Vec<f64>,
    /// Of the whole scene: the flow of one filament at another is known to the round-off of the largest.
    largest: f64,
    /// Weights of the merit by degree of freedom, 1/N.
    weight: Vec<f64>,
    /// Weights of the fluid's equation in the linear solver, by component of the immersed nodes.
    pub slip_weight: Vec<f64>,
    /// Resistance of every immersed node by itself over `8 pi mu`: turns residuals of the fluid's equation into forces.
    drag_per_slip: Vec<f64>,
    drag: Vec<f64>,
}

impl Targets {
    pub fn new(model: &Model, fluid_dofs: usize) -> Self {
        Self {
            goal: Goal::Residual(1.0),
            floor: vec![0.0; model.dof_count],
            force: vec![0.0; model.filaments.all().len()],
            largest: 0.0,
            weight: vec![1.0; model.dof_count],
            slip_weight: vec![1.0; 3 * fluid_dofs],
            drag_per_slip: Vec::new(),
            drag: vec![0.0; model.dof_count],
        }
    }

    /// Prepares for the solve of a step from the degrees of freedom `q` to a goal; an implicit fluid comes with the degrees of freedom of its
    /// nodes.
    pub fn aim(
        &mut self,
        model: &Model,
        step: &Step,
        goal: Goal,
        fluid: Option<(&mut (dyn FluidModel + 'static), &[usize])>,
        q: &[f64],
    ) {
        self.goal = goal;
        self.drag.fill(0.0);
        self.drag_per_slip.clear();
        if let Some((fluid, fluid_dofs)) = fluid {
            let local: Vec<f64> = fluid.local().iter().map(|block: &Mat3| block.trace() / 3.0).collect();
            for (&dof, drag) in fluid_dofs.iter().zip(&local) {
                self.drag[dof..dof + 3].fill(*drag);
            }
            if let Some(mobility) = fluid.nonlocal() {
                self.drag_per_slip.extend(local.iter().map(|drag| drag / mobility.scale()));
            }
        }
        let inertia = if step.scheme.has_inertia() { step.rate * step.rate } else { 0.0 };
        let known = (&self.drag[..], &step.state.frames.twists[..]);
        model.round_off.floors(model, (step.rate, inertia), known, q, &mut self.floor);
    }

    fn target(&self, model: &Model, dof: usize) -> f64 {
        let filament = model.filaments.of_dof()[dof];
        let least = LEAST * model.filaments.all()[filament].bending_force;
        match self.goal {
            Goal::Residual(tolerance) => (tolerance * self.force[filament].max(least)).max(self.floor[dof]),
            Goal::Correction(_) => self.floor[dof],
        }
    }

    /// The target of a residual of the fluid's equation, as a force.
    fn slip_target(&self, model: &Model, dof: usize) -> f64 {
        self.target(model, dof).max(2.0 * f64::EPSILON * self.largest)
    }

    /// Takes the largest forces of a residual without its elastic part.
    pub fn measure(&mut self, model: &Model, residual: &[f64]) {
        self.force.fill(0.0);
        for ((residual, weight), &filament) in residual.iter().zip(&model.force_weight).zip(model.filaments.of_dof()) {
            self.force[filament] = self.force[filament].max(residual.abs() * weight);
        }
        self.largest = self.force.iter().copied().fold(0.0, f64::max);
        // What is held has no motion of its own to be found: the flow past it is wanted as exactly as the least of the others asks.
        let filaments = model.filaments.all();
        let free = self.force.iter().zip(filaments).filter(|(_, filament)| !filament.held);
        let least = free.map(|(force, _)| *force).fold(f64::INFINITY, f64::min);
        for (force, _) in self.force.iter_mut().zip(filaments).filter(|(_, filament)| filament.held) {
            *force = force.max(if least.is_finite() { least } else { 0.0 });
        }
    }

    /// Size of a residual and of that of the fluid's equation: the norm is the largest nodal force or, divided by the mean edge of its
    /// filament, moment, N; velocities count with the node's own drag. Entries are numbered by degrees of freedom.
    pub fn size(&self, model: &Model, residual: &[f64], slip: &[f64], fluid_dofs: &[usize]) -> Size {
        let mut size = Size { norm: 0.0, excess: 0.0, merit: 0.0, worst: 0 };
        let mut count = |force: f64, target: f64, dof: usize| {
            size.norm = size.norm.max(force);
            // A residual that is not a number is larger than any.
            if force > size.excess * target || force.is_nan() {
                size.excess = force / target;
                size.worst = dof;
            }
            size.merit += (force * self.weight[dof]).powi(2);
        };
        for (dof, residual) in residual.iter().enumerate() {
            count(residual.abs() * model.force_weight[dof], self.target(model, dof), dof);
        }
        for (k, drag) in self.drag_per_slip.iter().enumerate() {
            for c in 0..3 {
                let dof = fluid_dofs[k] + c;
                count(slip[3 * k + c].abs() * drag, self.slip_target(model, dof), dof);
            }
        }
        size.merit = size.merit.sqrt();
        size
    }

    /// Weights the next merits, and the fluid's equation in the linear solver, by what is to be reached where.
    pub fn weigh(&mut self, model: &Model, fluid_dofs: &[usize]) {
        for dof in 0..self.weight.len() {
            let target = self.target(model, dof);
            // An angle that nothing resists has no target, and no residual either.
            self.weight[dof] = if target > 0.0 { 1.0 / target } else { 0.0 };
        }
        let free = model.filaments.all().iter().filter(|filament| !filament.held);
        let smallest = free.map(|filament| filament.size).fold(f64::INFINITY, f64::min).min(f64::MAX);
        let mut slip_weight = std::mem::take(&mut self.slip_weight);
        for (k, weight) in slip_weight.iter_mut().take(3 * self.drag_per_slip.len()).enumerate() {
            let dof = fluid_dofs[k / 3] + k % 3;
            *weight = match self.goal {
                Goal::Residual(_) => self.drag_per_slip[k / 3] / self.slip_target(model, dof),
                Goal::Correction(_) => {
                    let filament = model.filaments.all()[model.filaments.of_dof()[dof]];
                    1.0 / if filament.held { smallest } else { filament.size }
                }
            };
        }
        let largest = slip_weight.iter().copied().fold(0.0, f64::max);
        slip_weight.iter_mut().for_each(|weight| *weight /= largest);
        self.slip_weight = slip_weight;
    }
}
