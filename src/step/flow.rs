//! The fluid in a step's equations: a drag model at one geometry, the forces it exerts, and its equation where it is nonlocal.

use rayon::ThreadPool;

use crate::fluid::FluidModel;
use crate::kinematics::points::{Nodes, Points};
use crate::linear::LinearError;
use crate::model::Model;
use crate::step::given::Step;
use crate::step::unknowns::Unknowns;
use crate::{Mat3, Vec3};

/// The drag model with its memory; none in a dry scene.
pub(crate) struct Flow {
    fluid: Option<Box<dyn FluidModel>>,
    nodes: Nodes,
    /// Velocities of the immersed nodes relative to the background, then forces on the fluid.
    pub values: Vec<f64>,
    /// The force of the velocities at the beginning of the step, where the fluid is explicit, N.
    constant: Vec<f64>,
}

impl Flow {
    /// A fresh one for a model.
    pub fn new(model: &Model) -> Result<Self, LinearError> {
        let nodes = Nodes::new(model.storage.fluid_dofs.clone());
        let values = vec![0.0; 3 * nodes.count()];
        Ok(Self { fluid: model.fluid()?, nodes, values, constant: vec![0.0; model.dof_count] })
    }

    /// The drag model at the geometry of the last [`Self::place`].
    pub fn model_mut(&mut self) -> Option<&mut (dyn FluidModel + 'static)> {
        self.fluid.as_deref_mut()
    }

    /// The drag model, if its equation is one of the unknowns', and the degrees of freedom of its nodes.
    pub fn implicit_nonlocal(&mut self, step: &Step) -> Option<(&mut (dyn FluidModel + 'static), &[usize])> {
        let implicit = step.scheme.fluid_is_implicit();
        let fluid = self.fluid.as_deref_mut().filter(|fluid| implicit && !fluid.is_local())?;
        Some((fluid, self.nodes.dofs()))
    }

    /// The drag model, if it resists the new velocities, and the degrees of freedom of its nodes.
    pub fn implicit(&mut self, step: &Step) -> Option<(&mut (dyn FluidModel + 'static), &[usize])> {
        let implicit = step.scheme.fluid_is_implicit();
        Some((self.fluid.as_deref_mut().filter(|_| implicit)?, self.nodes.dofs()))
    }

    /// Whether it is nonlocal.
    pub fn is_nonlocal(&self) -> bool {
        self.fluid.as_ref().is_some_and(|fluid| !fluid.is_local())
    }

    /// The immersed nodes.
    pub fn nodes(&self) -> &Nodes {
        &self.nodes
    }

    /// Degrees of freedom of the immersed nodes.
    pub fn dofs(&self) -> &[usize] {
        self.nodes.dofs()
    }

    /// The force of an explicit fluid, N.
    pub fn constant(&self) -> &[f64] {
        &self.constant
    }

    /// Moves to a geometry.
    pub fn place(&mut self, positions: &[Vec3], pool: Option<&ThreadPool>) -> Result<(), LinearError> {
        self.fluid.as_mut().map_or(Ok(()), |fluid| fluid.update(positions, pool))
    }

    /// Finds the force of the velocities at the beginning of a step, if it is explicit.
    pub fn begin(&mut self, step: &Step, pool: Option<&ThreadPool>) -> Result<(), LinearError> {
        self.constant.fill(0.0);
        if let Some(fluid) = self.fluid.as_mut().filter(|_| !step.scheme.fluid_is_implicit()) {
            self.nodes.velocities(&|dof| step.state.velocity[dof], &mut self.values);
            subtract_background(step, fluid.immersed(), &mut self.values);
            fluid.resist(&mut self.values, pool)?;
            self.nodes.add_forces(&self.values, &mut self.constant);
        }
        Ok(())
    }

    /// Adds the forces of a trial to the residual, and sets the residual of the fluid's equation, if it has one.
    pub fn add_forces(
        &mut self,
        step: &Step,
        trial: &Unknowns,
        pool: Option<&ThreadPool>,
        (residual, slip): (&mut [f64], &mut [f64]),
    ) -> Result<(), LinearError> {
        let Some(fluid) = self.fluid.as_mut().filter(|_| step.scheme.fluid_is_implicit()) else { return Ok(()) };
        let increment = step.increment();
        self.nodes.velocities(&|dof| increment.rate_of(dof, trial.q[dof]), &mut self.values);
        subtract_background(step, fluid.immersed(), &mut self.values);
        match fluid.nonlocal() {
            None => fluid.resist(&mut self.values, pool)?,
            Some(mobility) => {
                mobility.apply(&trial.density, slip, pool)?;
                let scale = mobility.scale();
                slip.iter_mut().zip(&self.values).for_each(|(slip, velocity)| *slip -= scale * velocity);
                mobility.weigh(&trial.density, &mut self.values);
            }
        }
        self.nodes.add_forces(&self.values, residual);
        Ok(())
    }

    /// Adds the derivative of the forces: every node's own resistance, which is all of it where the fluid is local.
    pub fn add_matrix(&self, model: &Model, step: &Step, jacobian: &mut [f64]) {
        let Some(fluid) = self.fluid.as_deref().filter(|_| step.scheme.fluid_is_implicit()) else { return };
        for (slots, block) in model.storage.fluid_blocks.iter().zip(fluid.local()) {
            for (&slot, entry) in slots.iter().zip(block.as_slice()) {
                jacobian[slot] += entry * step.rate;
            }
        }
    }

    /// Finds the forces on the fluid at given rates and force densities; they are left in [`Self::values`].
    pub fn find_forces(&mut self, step: &Step, (velocity, density): (&[f64], &[f64]), pool: Option<&ThreadPool>) {
        let Some(fluid) = self.fluid.as_deref_mut() else { return };
        if let Some(mobility) = fluid.nonlocal() {
            mobility.weigh(density, &mut self.values);
            return;
        }
        self.nodes.velocities(&|dof| velocity[dof], &mut self.values);
        subtract_background(step, fluid.immersed(), &mut self.values);
        if fluid.resist(&mut self.values, pool).is_err() {
            self.values.fill(0.0);
        }
    }

    /// Adds every node's own stiffness against displacement within the step, N/m: its drag over the step.
    pub fn add_node_stiffness(&self, step: &Step, out: &mut [f64]) {
        let Some(fluid) = self.fluid.as_ref().filter(|_| step.scheme.fluid_is_implicit()) else { return };
        let drag = |block: &Mat3| block.trace() * step.rate / 3.0;
        let mean = fluid.local().iter().map(drag).sum::<f64>() / fluid.local().len() as f64;
        let mut immersed = vec![false; out.len()];
        for (&node, block) in fluid.immersed().iter().zip(fluid.local()) {
            out[node] += drag(block);
            immersed[node] = true;
        }
        // A dry node has no drag of its own; the mean of the others is as good a scale for its contacts as any.
        out.iter_mut().zip(&immersed).filter(|(_, wet)| !**wet).for_each(|(stiffness, _)| *stiffness += mean);
    }
}

/// Makes velocities of immersed nodes those relative to the background flow.
fn subtract_background(step: &Step, immersed: &[usize], velocities: &mut [f64]) {
    let Some(ambient) = &step.drives.ambient else { return };
    let background = ambient.background().node_velocities;
    for (&node, velocity) in immersed.iter().zip(velocities.chunks_exact_mut(3)) {
        (0..3).for_each(|c| velocity[c] -= background[node][c]);
    }
}
