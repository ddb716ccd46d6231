//! Connected parts of a scene, and which of them nothing holds.

/// Number of every node's connected part, and which parts nothing holds; parts that may touch count as one.
pub(crate) fn parts(edges: &[[usize; 2]], held: &[bool], touching: bool) -> (Vec<usize>, Vec<bool>) {
    let mut root: Vec<usize> = (0..held.len()).collect();
    fn find(root: &mut [usize], mut node: usize) -> usize {
        while root[node] != node {
            root[node] = root[root[node]];
            node = root[node];
        }
        node
    }
    for &[i, j] in edges {
        let (i, j) = (find(&mut root, i), find(&mut root, j));
        root[i.max(j)] = i.min(j);
    }
    let mut number = vec![usize::MAX; held.len()];
    let mut free = Vec::new();
    let mut part_of = Vec::with_capacity(held.len());
    for node in 0..held.len() {
        let top = if touching { 0 } else { find(&mut root, node) };
        if number[top] == usize::MAX {
            number[top] = free.len();
            free.push(true);
        }
        part_of.push(number[top]);
        free[number[top]] &= !held[node];
    }
    (part_of, free)
}
