//! The fixed sparsity pattern of a sum of small dense element matrices, in compressed sparse columns.

/// Pattern of a square sparse matrix together with the storage slot of every entry of every element matrix.
#[derive(Debug, Clone)]
pub struct Pattern {
    size: usize,
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
}

/// Storage slots of one element matrix: entry `(i, j)` of an `m x m` element is stored at `slots[i + m * j]`.
#[derive(Debug, Clone)]
pub struct ElementSlots {
    slots: Vec<u32>,
    width: usize,
}

impl ElementSlots {
    /// Number of degrees of freedom of the element.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Adds the column-major element matrix to the values.
    #[inline]
    pub fn add(&self, element: &[f64], values: &mut [f64]) {
        debug_assert_eq!(element.len(), self.slots.len());
        for (&slot, &entry) in self.slots.iter().zip(element) {
            values[slot as usize] += entry;
        }
    }
}

impl Pattern {
    /// The union of dense blocks over the given stencils (sets of degrees of freedom) and the whole diagonal.
    pub fn from_stencils<'a>(size: usize, stencils: impl Iterator<Item = &'a [usize]>) -> Self {
        let mut pairs: Vec<(usize, usize)> = (0..size).map(|i| (i, i)).collect();
        for stencil in stencils {
            for &column in stencil {
                pairs.extend(stencil.iter().map(|&row| (column, row)));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let mut column_starts = vec![0; size + 1];
        for &(column, _) in &pairs {
            column_starts[column + 1] += 1;
        }
        for column in 0..size {
            column_starts[column + 1] += column_starts[column];
        }
        Self { size, column_starts, row_indices: pairs.into_iter().map(|(_, row)| row).collect() }
    }

    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.row_indices.len()
    }

    /// Start of every column in [`Self::row_indices`], one more than there are columns.
    pub fn column_starts(&self) -> &[usize] {
        &self.column_starts
    }

    /// Row index of every stored entry, ascending within a column.
    pub fn row_indices(&self) -> &[usize] {
        &self.row_indices
    }

    /// Where entry `(row, column)` is stored.
    pub fn slot(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.column_starts[column]..self.column_starts[column + 1];
        self.row_indices[range.clone()].binary_search(&row).ok().map(|k| range.start + k)
    }

    /// This pattern and dense blocks over further stencils, each given by the first of every three degrees of freedom in a row,
    /// no two of which overlap; and where each of its own entries is stored there.
    pub fn extended<'a>(&self, stencils: impl Iterator<Item = &'a [usize]>) -> (Self, Vec<u32>) {
        let mut blocks: Vec<(usize, usize)> = stencils
            .flat_map(|stencil| stencil.iter().flat_map(move |&column| stencil.iter().map(move |&row| (column, row))))
            .collect();
        blocks.sort_unstable();
        blocks.dedup();
        let mut further = Vec::with_capacity(9 * blocks.len());
        for column_blocks in blocks.chunk_by(|(a, _), (b, _)| a == b) {
            for column in column_blocks[0].0..column_blocks[0].0 + 3 {
                further.extend(column_blocks.iter().flat_map(|&(_, row)| (row..row + 3).map(move |row| (column, row))));
            }
        }
        let mut extended = Self { size: self.size, column_starts: vec![0], row_indices: Vec::new() };
        let mut embedding = Vec::with_capacity(self.entries());
        let mut next = further.into_iter().peekable();
        for column in 0..self.size {
            for &row in &self.row_indices[self.column_starts[column]..self.column_starts[column + 1]] {
                while let Some((_, above)) = next.next_if(|&(c, r)| c == column && r <= row) {
                    if above < row {
                        extended.row_indices.push(above);
                    }
                }
                embedding.push(extended.row_indices.len() as u32);
                extended.row_indices.push(row);
            }
            while let Some((_, below)) = next.next_if(|&(c, _)| c == column) {
                extended.row_indices.push(below);
            }
            extended.column_starts.push(extended.row_indices.len());
        }
        (extended, embedding)
    }

    /// Slots of the element matrix on a stencil that was part of the pattern's construction.
    ///
    /// # Panics
    /// If the stencil was not part of it: a defect of the caller, found on construction of a model.
    pub fn element_slots(&self, stencil: &[usize]) -> ElementSlots {
        let entries = stencil.iter().flat_map(|&column| stencil.iter().map(move |&row| (row, column)));
        let slots = entries
            .map(|(row, column)| self.slot(row, column).expect("the stencil belongs to the pattern") as u32)
            .collect();
        ElementSlots { slots, width: stencil.len() }
    }

    /// `out += A x` for the values of a matrix on this pattern.
    pub fn multiply_add(&self, values: &[f64], x: &[f64], out: &mut [f64]) {
        for column in 0..self.size {
            let range = self.column_starts[column]..self.column_starts[column + 1];
            let scale = x[column];
            for (&row, &value) in self.row_indices[range.clone()].iter().zip(&values[range]) {
                out[row] += value * scale;
            }
        }
    }
}
