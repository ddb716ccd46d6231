//! How the mobility of regularized Stokeslet segments is multiplied and inverted: by a stored matrix in small scenes, by
//! the fast multipole method and GMRES in large ones.

use rayon::ThreadPool;

use super::far_field::{FarField, FarFieldError};
use super::kernel::Boundary;
use super::kernel::network::Segments;
use super::stokeslet::mobility;
use crate::linear::LinearError;
use crate::linear::dense::{DenseLu, multiply};
use crate::linear::krylov::{Gmres, LinearOperator};

/// Memory for the exact blocks of close pairs, bytes; those that do not fit are computed anew in every product.
pub const BLOCK_MEMORY: usize = 2 << 30;

/// GMRES iterations in which the mobility must be inverted; the local drag as preconditioner leaves a few tens.
const KRYLOV_LIMIT: usize = 200;

/// When the mobility is multiplied without its matrix, and how exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarFieldChoice {
    /// Immersed nodes from which on there is no matrix.
    pub from: usize,
    /// Largest error of a component of the product, relative to the largest component.
    pub error: f64,
}

impl FarFieldChoice {
    /// The matrix, whatever its size.
    pub const NEVER: Self = Self { from: usize::MAX, error: 1e-6 };
}

/// The product with the mobility at a geometry.
pub(super) enum Product {
    /// The matrix, by columns.
    Stored { matrix: Vec<f64>, single: SinglePrecision, lu: DenseLu, factored: bool },
    /// No matrix; nothing before the first geometry.
    Fast { error: f64, far_field: Option<Box<FarField>>, gmres: Gmres },
}

impl Product {
    /// For so many immersed nodes.
    pub fn new(nodes: usize, choice: &FarFieldChoice) -> Self {
        if nodes >= choice.from {
            Self::Fast {
                error: choice.error,
                far_field: None,
                gmres: Gmres::new(3 * nodes, KRYLOV_LIMIT.min(3 * nodes)),
            }
        } else {
            Self::Stored {
                matrix: vec![0.0; 9 * nodes * nodes],
                single: SinglePrecision::default(),
                lu: DenseLu::new(3 * nodes),
                factored: false,
            }
        }
    }

    pub fn is_stored(&self) -> bool {
        matches!(self, Self::Stored { .. })
    }

    /// Moves to a geometry; with a boundary there is a matrix.
    pub fn update(
        &mut self,
        segments: Segments<'_>,
        boundary: Option<&Boundary>,
        pool: Option<&ThreadPool>,
    ) -> Result<(), LinearError> {
        let Segments { nodes, edges, epsilon } = segments;
        match self {
            Self::Stored { matrix, single, factored, .. } => {
                mobility(nodes, nodes, edges, epsilon, matrix, pool);
                if let Some(boundary) = boundary {
                    boundary.add_to_mobility(segments, nodes, matrix, pool);
                }
                single.rounded = false;
                *factored = false;
            }
            Self::Fast { .. } if boundary.is_some() => {
                return Err(LinearError::Product("near a wall they are made with the matrix".to_owned()));
            }
            Self::Fast { far_field: Some(far_field), .. } => far_field.update(nodes, None, pool)?,
            Self::Fast { error, far_field, .. } => {
                let built = FarField::new(nodes, edges, epsilon, None, *error, BLOCK_MEMORY, pool)?;
                *far_field = Some(Box::new(built));
            }
        }
        Ok(())
    }

    /// `out = A f`.
    pub fn apply(&mut self, density: &[f64], out: &mut [f64], pool: Option<&ThreadPool>) -> Result<(), LinearError> {
        match self {
            Self::Stored { matrix, .. } => multiply(matrix, density, out, pool),
            Self::Fast { far_field, .. } => placed(far_field)?.apply(density, out, pool)?,
        }
        Ok(())
    }

    /// `out = A f` to single precision: half the memory to go through.
    pub fn apply_roughly(
        &mut self,
        density: &[f64],
        out: &mut [f64],
        pool: Option<&ThreadPool>,
    ) -> Result<(), LinearError> {
        match self {
            Self::Stored { matrix, single, .. } => {
                single.apply(matrix, density, out, pool);
                Ok(())
            }
            Self::Fast { .. } => self.apply(density, out, pool),
        }
    }

    /// `f <- A^-1 f`; `precondition` does so roughly.
    pub fn invert(
        &mut self,
        flow: &mut [f64],
        precondition: &mut dyn FnMut(&mut [f64]) -> Result<(), LinearError>,
        pool: Option<&ThreadPool>,
    ) -> Result<(), LinearError> {
        match self {
            Self::Stored { matrix, lu, factored, .. } => {
                if !*factored {
                    lu.matrix_mut().copy_from_slice(matrix);
                    lu.factor()?;
                    *factored = true;
                }
                lu.solve(flow)
            }
            Self::Fast { error, far_field, gmres } => {
                let mut system = System { far_field: placed(far_field)?, precondition, pool };
                let rhs = flow.to_vec();
                gmres.solve(&mut system, &rhs, flow, *error).map(|_| ())
            }
        }
    }
}

/// The matrix rounded to single precision, when it is first needed, and vectors to go with it.
#[derive(Default)]
pub(super) struct SinglePrecision {
    matrix: Vec<f32>,
    density: Vec<f32>,
    flow: Vec<f32>,
    rounded: bool,
}

impl SinglePrecision {
    fn apply(&mut self, matrix: &[f64], density: &[f64], out: &mut [f64], pool: Option<&ThreadPool>) {
        if !self.rounded {
            self.matrix.clear();
            self.matrix.extend(matrix.iter().map(|&entry| entry as f32));
            self.rounded = true;
        }
        // Sizes of force densities are scaled out, which single precision need not hold.
        let largest = density.iter().fold(0.0, |size: f64, value| size.max(value.abs()));
        let scale = if largest > 0.0 { largest } else { 1.0 };
        self.density.clear();
        self.density.extend(density.iter().map(|value| (value / scale) as f32));
        self.flow.resize(out.len(), 0.0);
        multiply(&self.matrix, &self.density, &mut self.flow, pool);
        out.iter_mut().zip(&self.flow).for_each(|(out, flow)| *out = f64::from(*flow) * scale);
    }
}

fn placed(far_field: &mut Option<Box<FarField>>) -> Result<&mut FarField, LinearError> {
    far_field.as_deref_mut().ok_or_else(|| LinearError::Product("it has no geometry yet".to_owned()))
}

impl From<FarFieldError> for LinearError {
    fn from(error: FarFieldError) -> Self {
        Self::Product(error.to_string())
    }
}

/// The mobility as GMRES sees it.
struct System<'a> {
    far_field: &'a mut FarField,
    precondition: &'a mut dyn FnMut(&mut [f64]) -> Result<(), LinearError>,
    pool: Option<&'a ThreadPool>,
}

impl LinearOperator for System<'_> {
    fn apply(&mut self, x: &[f64], out: &mut [f64]) -> Result<(), LinearError> {
        Ok(self.far_field.apply(x, out, self.pool)?)
    }

    fn precondition(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        (self.precondition)(x)
    }
}
