//! Where the derivative of the force balance is stored: its pattern, the blocks of nodes in it, what is held, and the analysis of its
//! factorization. All of it is made once and shared by every simulation of a model.

use std::sync::Arc;

use crate::linear::LinearError;
use crate::linear::ldlt::Analysis;
use crate::linear::pattern::Pattern;

/// Storage of nine entries: the block of a node with itself, column by column.
pub(crate) type BlockSlots = [usize; 9];

/// The storage of a model's derivative.
pub(crate) struct Storage {
    pub pattern: Arc<Pattern>,
    pub analysis: Arc<Analysis>,
    /// Blocks of all nodes.
    pub node_blocks: Vec<BlockSlots>,
    /// First degree of freedom of every immersed node, and its block.
    pub fluid_dofs: Vec<usize>,
    pub fluid_blocks: Vec<BlockSlots>,
    /// Entries in rows and columns of what is prescribed, and those on the diagonal among them.
    pub held: Vec<usize>,
    pub held_diagonal: Vec<usize>,
}

impl Storage {
    /// Looks up everything on a pattern; nodes are given by their first degrees of freedom.
    ///
    /// # Errors
    /// [`LinearError`] if the pattern cannot be analysed, or does not hold a block.
    pub fn new(
        pattern: Pattern,
        node_dofs: &[usize],
        fluid_dofs: Vec<usize>,
        prescribed: &[bool],
    ) -> Result<Self, LinearError> {
        let slot =
            |row: usize, column: usize| pattern.slot(row, column).ok_or(LinearError::Singular { what: "sparse" });
        let blocks = |dofs: &[usize]| {
            let of_node = |&dof: &usize| {
                let mut slots = [0; 9];
                for column in 0..3 {
                    for row in 0..3 {
                        slots[row + 3 * column] = slot(dof + row, dof + column)?;
                    }
                }
                Ok(slots)
            };
            dofs.iter().map(of_node).collect::<Result<Vec<_>, LinearError>>()
        };
        let mut held = Vec::new();
        for (column, range) in pattern.column_starts().windows(2).enumerate() {
            let rows = range[0]..range[1];
            held.extend(rows.filter(|&k| prescribed[pattern.row_indices()[k]] || prescribed[column]));
        }
        let diagonal = (0..pattern.size()).filter(|&dof| prescribed[dof]).map(|dof| slot(dof, dof));
        Ok(Self {
            node_blocks: blocks(node_dofs)?,
            fluid_blocks: blocks(&fluid_dofs)?,
            fluid_dofs,
            held,
            held_diagonal: diagonal.collect::<Result<_, _>>()?,
            analysis: Arc::new(Analysis::new(&pattern)?),
            pattern: Arc::new(pattern),
        })
    }
}
