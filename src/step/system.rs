//! The sparse matrix of a step's linear systems: the model's, and contact's, whose pattern changes; with its factors.

use std::sync::Arc;

use crate::linear::LinearError;
use crate::linear::nearly_symmetric::NearlySymmetric;
use crate::model::Model;
use crate::model::storage::Storage;
use crate::step::contact::{ContactStrategy, Treatment};

/// Matrix and factors.
pub(crate) struct SparseSystem {
    factors: NearlySymmetric,
    /// Where the matrix stores the entries of the model's pattern; it may have more.
    embedding: Vec<u32>,
}

impl SparseSystem {
    /// Memory on a model's own pattern.
    pub fn new(Storage { pattern, analysis, .. }: &Storage) -> Self {
        Self {
            factors: NearlySymmetric::of(Arc::clone(pattern), Arc::clone(analysis)),
            embedding: (0..pattern.entries() as u32).collect(),
        }
    }

    /// Fills the matrix with a derivative on the model's pattern and with that of contact, and factors it.
    pub fn factor(
        &mut self,
        model: &Model,
        jacobian: &[f64],
        contact: Option<&mut (dyn ContactStrategy + 'static)>,
        (rate, treatment): (f64, Treatment),
    ) -> Result<(), LinearError> {
        let mut contact = contact;
        if let Some((contact, blocks)) = contact.as_deref_mut().and_then(|c| c.new_blocks().map(|blocks| (c, blocks))) {
            let (pattern, embedding) = model.storage.pattern.extended(blocks.iter().map(Vec::as_slice));
            contact.bind(&pattern);
            self.factors = NearlySymmetric::new(pattern)?;
            self.embedding = embedding;
        }
        let values = self.factors.values_mut();
        values.fill(0.0);
        self.embedding.iter().zip(jacobian).for_each(|(&slot, value)| values[slot as usize] = *value);
        let symmetric = contact.is_none_or(|contact| {
            contact.add_matrix(rate, treatment, values);
            contact.is_symmetric(treatment)
        });
        self.factors.factor(symmetric)
    }

    /// The factors of the last matrix.
    pub fn factors(&mut self) -> &mut NearlySymmetric {
        &mut self.factors
    }
}
