//! Right-preconditioned GMRES (Saad and Schultz 1986) with reused memory, for operators known only by their action.

use super::LinearError;

/// What GMRES needs to know of a linear system.
pub trait LinearOperator {
    /// `out = A x`.
    ///
    /// # Errors
    /// If the action cannot be computed.
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError>;

    /// `x <- P^-1 x`, an approximate solve.
    ///
    /// # Errors
    /// If the preconditioner is singular.
    fn precondition(&mut self, x: &mut [f64]) -> Result<(), LinearError>;
}

/// Workspace of GMRES without restarts.
pub struct Gmres {
    size: usize,
    limit: usize,
    basis: Vec<f64>,
    preconditioned: Vec<f64>,
    hessenberg: Vec<f64>,
    rotations: Vec<(f64, f64)>,
    projected: Vec<f64>,
}

/// Part of a product, out of reach of the products before it, that is no more than round-off: the operator is singular there.
const DEPENDENT: f64 = 16.0 * f64::EPSILON;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

impl Gmres {
    /// Workspace for systems of the given size and at most `limit` iterations.
    pub fn new(size: usize, limit: usize) -> Self {
        Self {
            size,
            limit,
            basis: vec![0.0; size * (limit + 1)],
            preconditioned: vec![0.0; size * limit],
            hessenberg: vec![0.0; (limit + 1) * limit],
            rotations: vec![(0.0, 0.0); limit],
            projected: vec![0.0; limit + 1],
        }
    }

    /// Solves `A x = rhs` from `x = 0` to `|rhs - A x| <= tolerance |rhs|` in the Euclidean norm; returns the iterations.
    ///
    /// # Errors
    /// [`LinearError::Krylov`] if the tolerance is not reached; `x` then holds the best iterate.
    pub fn solve(
        &mut self,
        operator: &mut impl LinearOperator,
        rhs: &[f64],
        x: &mut [f64],
        tolerance: f64,
    ) -> Result<usize, LinearError> {
        let (n, limit) = (self.size, self.limit);
        x.fill(0.0);
        let scale = norm(rhs);
        if scale == 0.0 {
            return Ok(0);
        }
        if !scale.is_finite() {
            return Err(LinearError::Singular { what: "Newton" });
        }
        for (v, r) in self.basis[..n].iter_mut().zip(rhs) {
            *v = r / scale;
        }
        self.projected.fill(0.0);
        self.projected[0] = 1.0;
        let mut iterations = 0;
        let mut residual = 1.0;
        while iterations < limit && residual > tolerance {
            let k = iterations;
            let (known, rest) = self.basis.split_at_mut((k + 1) * n);
            let candidate = &mut rest[..n];
            let z = &mut self.preconditioned[k * n..(k + 1) * n];
            z.copy_from_slice(&known[k * n..]);
            operator.precondition(z)?;
            operator.apply(z, candidate)?;
            let column = &mut self.hessenberg[k * (limit + 1)..(k + 1) * (limit + 1)];
            column.fill(0.0);
            // Modified Gram-Schmidt, twice: orthogonality to round-off at the price of a few dot products.
            for _ in 0..2 {
                for j in 0..=k {
                    let vector = &known[j * n..(j + 1) * n];
                    let overlap = dot(vector, candidate);
                    column[j] += overlap;
                    for (c, v) in candidate.iter_mut().zip(vector) {
                        *c -= overlap * v;
                    }
                }
            }
            let length = norm(candidate);
            if !length.is_finite() {
                return Err(LinearError::Singular { what: "Newton" });
            }
            column[k + 1] = length;
            let stretched = norm(&column[..k + 2]);
            for j in 0..k {
                let (c, s) = self.rotations[j];
                let (upper, lower) = (column[j], column[j + 1]);
                column[j] = c * upper + s * lower;
                column[j + 1] = c * lower - s * upper;
            }
            let radius = column[k].hypot(length);
            if radius <= DEPENDENT * stretched {
                break;
            }
            iterations += 1;
            let (c, s) = (column[k] / radius, length / radius);
            self.rotations[k] = (c, s);
            column[k] = radius;
            column[k + 1] = 0.0;
            self.projected[k + 1] = -s * self.projected[k];
            self.projected[k] *= c;
            residual = self.projected[k + 1].abs();
            if length > 0.0 {
                candidate.iter_mut().for_each(|value| *value /= length);
            } else {
                break;
            }
        }
        self.combine(iterations, scale, x);
        if residual <= tolerance { Ok(iterations) } else { Err(LinearError::Krylov { residual, iterations }) }
    }

    fn combine(&mut self, iterations: usize, scale: f64, x: &mut [f64]) {
        let stride = self.limit + 1;
        for row in (0..iterations).rev() {
            let mut value = self.projected[row];
            for column in row + 1..iterations {
                value -= self.hessenberg[row + column * stride] * self.projected[column];
            }
            let pivot = self.hessenberg[row + row * stride];
            self.projected[row] = value / pivot;
        }
        for (k, z) in self.preconditioned.chunks_exact(self.size).take(iterations).enumerate() {
            let weight = scale * self.projected[k];
            for (xi, zi) in x.iter_mut().zip(z) {
                *xi += weight * zi;
            }
        }
    }
}
