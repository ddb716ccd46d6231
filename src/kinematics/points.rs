//! What degrees of freedom move: points with positions `x = X(q)` and velocities `K q'`, whose forces go back by the transpose of `K`.
//!
//! Nodes are the points of today: `K` picks three degrees of freedom for each. Points of a body that moves as a whole are others.

/// Points that degrees of freedom move.
pub trait Points {
    /// How many there are.
    fn count(&self) -> usize;

    /// `out = K q'`, three components a point; `rate` gives the rate of a degree of freedom.
    fn velocities(&self, rate: &dyn Fn(usize) -> f64, out: &mut [f64]);

    /// `out += K^T F`: forces on points, three components each, to degrees of freedom.
    fn add_forces(&self, forces: &[f64], out: &mut [f64]);
}

/// Nodes as points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Nodes {
    dofs: Vec<usize>,
}

impl Nodes {
    /// Nodes given by their first degrees of freedom.
    pub fn new(dofs: Vec<usize>) -> Self {
        Self { dofs }
    }

    /// Their first degrees of freedom.
    pub fn dofs(&self) -> &[usize] {
        &self.dofs
    }
}

impl Points for Nodes {
    fn count(&self) -> usize {
        self.dofs.len()
    }

    fn velocities(&self, rate: &dyn Fn(usize) -> f64, out: &mut [f64]) {
        for (&dof, chunk) in self.dofs.iter().zip(out.chunks_exact_mut(3)) {
            (0..3).for_each(|c| chunk[c] = rate(dof + c));
        }
    }

    fn add_forces(&self, forces: &[f64], out: &mut [f64]) {
        for (&dof, chunk) in self.dofs.iter().zip(forces.chunks_exact(3)) {
            (0..3).for_each(|c| out[dof + c] += chunk[c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_do_the_work_of_the_degrees_of_freedom_they_go_back_to() {
        let nodes = Nodes::new(vec![4, 0]);
        let rates = [1.0, -2.0, 0.5, 9.0, 3.0, 0.25, -1.0];
        let forces = [0.3, 0.7, -0.2, 1.1, -0.4, 0.6];
        let (mut velocities, mut generalised) = ([0.0; 6], [0.0; 7]);
        nodes.velocities(&|dof| rates[dof], &mut velocities);
        nodes.add_forces(&forces, &mut generalised);
        let work = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((work(&forces, &velocities) - work(&generalised, &rates)).abs() < 1e-15);
        assert_eq!((nodes.count(), generalised[3]), (2, 0.0));
    }
}
