//! The unknowns of a step.

/// A trial solution: degrees of freedom, the force density on the fluid if that is nonlocal and implicit, and the tensions of edges as
/// Newton's method sees them, linear from iterate to iterate.
#[derive(Debug, Clone, Default)]
pub struct Unknowns {
    /// Degrees of freedom.
    pub q: Vec<f64>,
    /// Force density at the immersed nodes, N/m.
    pub density: Vec<f64>,
    /// Tensions, N.
    pub tensions: Vec<f64>,
}

impl Unknowns {
    /// Sets these to what is `part` of the way from others along a direction.
    pub fn advance(&mut self, from: &Self, direction: &Self, part: f64) {
        let go = |from: &[f64], direction: &[f64], out: &mut [f64]| {
            for ((out, from), direction) in out.iter_mut().zip(from).zip(direction) {
                *out = from + part * direction;
            }
        };
        go(&from.q, &direction.q, &mut self.q);
        go(&from.density, &direction.density, &mut self.density);
        go(&from.tensions, &direction.tensions, &mut self.tensions);
    }

    /// Sets these to the direction that leads from one to another.
    pub fn difference(&mut self, from: &Self, to: &Self) {
        let apart = |from: &[f64], to: &[f64], out: &mut [f64]| {
            for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
                *out = to - from;
            }
        };
        apart(&from.q, &to.q, &mut self.q);
        apart(&from.density, &to.density, &mut self.density);
        apart(&from.tensions, &to.tensions, &mut self.tensions);
    }
}
