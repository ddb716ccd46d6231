//! The sparse pattern: every entry of every element has its place, and no other has.

use std::collections::BTreeSet;

use flagrs::linear::pattern::Pattern;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use crate::matrices::{scrambled, values_on, vector};

/// What is stored, read off column by column.
fn stored(pattern: &Pattern) -> Vec<(usize, usize)> {
    (0..pattern.size())
        .flat_map(|column| {
            let range = pattern.column_starts()[column]..pattern.column_starts()[column + 1];
            pattern.row_indices()[range].iter().map(move |&row| (column, row))
        })
        .collect()
}

fn dense(pattern: &Pattern, values: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(pattern.size(), pattern.size());
    for (&(column, row), value) in stored(pattern).iter().zip(values) {
        matrix[(row, column)] = *value;
    }
    matrix
}

fn block(stencil: &[usize]) -> impl Iterator<Item = (usize, usize)> + '_ {
    stencil.iter().flat_map(move |&column| stencil.iter().map(move |&row| (column, row)))
}

#[test]
fn the_whole_diagonal_and_the_block_of_every_stencil_are_stored_in_order() {
    let stencils = [vec![3, 0], vec![1, 3]];
    let pattern = Pattern::from_stencils(5, stencils.iter().map(Vec::as_slice));
    let expected = [(0, 0), (0, 3), (1, 1), (1, 3), (2, 2), (3, 0), (3, 1), (3, 3), (4, 4)];
    assert_eq!(stored(&pattern), expected);
    assert_eq!((pattern.size(), pattern.entries()), (5, 9));
    assert_eq!(pattern.slot(3, 0), Some(1));
    assert_eq!(pattern.slot(1, 0), None);
}

#[test]
fn elements_are_added_where_their_stencil_says() {
    // Unsymmetric elements on stencils out of order that overlap.
    let stencils = [vec![4, 0, 2], vec![2, 1], vec![0, 4]];
    let pattern = Pattern::from_stencils(5, stencils.iter().map(Vec::as_slice));
    let (mut values, mut expected) = (vec![0.0; pattern.entries()], DMatrix::zeros(5, 5));
    for (number, stencil) in stencils.iter().enumerate() {
        let width = stencil.len();
        let element = scrambled(width) * (number as f64 + 1.0);
        let slots = pattern.element_slots(stencil);
        assert_eq!(slots.width(), width);
        slots.add(element.as_slice(), &mut values);
        for (i, &row) in stencil.iter().enumerate() {
            for (j, &column) in stencil.iter().enumerate() {
                expected[(row, column)] += element[(i, j)];
            }
        }
    }
    assert_eq!(dense(&pattern, &values), expected);
}

#[test]
#[should_panic(expected = "the stencil belongs to the pattern")]
fn a_stencil_that_was_not_announced_is_a_defect() {
    Pattern::from_stencils(3, [[0, 1].as_slice()].into_iter()).element_slots(&[1, 2]);
}

#[test]
fn a_product_is_added_to_what_is_there() {
    let stencils = [vec![0, 3], vec![1, 2, 3]];
    let pattern = Pattern::from_stencils(4, stencils.iter().map(Vec::as_slice));
    let values = values_on(&pattern, &scrambled(4));
    let x = vector(4);
    let before = DVector::from_column_slice(&[5.0, -1.0, 0.5, 2.0]);
    let mut out = before.clone();
    pattern.multiply_add(&values, x.as_slice(), out.as_mut_slice());
    assert!((out - (before + dense(&pattern, &values) * x)).amax() < 1e-15);
}

proptest! {
    #[test]
    fn an_extended_pattern_holds_its_own_entries_and_the_blocks_of_three(
        own in prop::collection::vec(prop::collection::vec(0_usize..15, 1..5), 0..5),
        further in prop::collection::vec(prop::collection::vec((0_usize..4).prop_map(|k| 4 * k), 1..4), 0..6),
    ) {
        let pattern = Pattern::from_stencils(15, own.iter().map(Vec::as_slice));
        let (extended, embedding) = pattern.extended(further.iter().map(Vec::as_slice));
        let whole: Vec<Vec<usize>> =
            further.iter().map(|stencil| stencil.iter().flat_map(|&first| first..first + 3).collect()).collect();
        let expected: BTreeSet<_> =
            stored(&pattern).into_iter().chain(whole.iter().flat_map(|stencil| block(stencil))).collect();
        prop_assert_eq!(stored(&extended), Vec::from_iter(expected));
        let places = stored(&extended);
        let embedded: Vec<_> = embedding.iter().map(|&slot| places[slot as usize]).collect();
        prop_assert_eq!(embedded, stored(&pattern));
    }
}
