//! Topology of a rod network and the interleaved numbering of its degrees of freedom.

/// A rod network cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// An edge names a node that does not exist, or the same node twice.
    #[error("edges[{edge}]: ({start}, {end}) is not allowed; must be two different nodes in 0..{nodes}")]
    Edge {
        /// Index of the edge.
        edge: usize,
        /// Its first node.
        start: usize,
        /// Its second node.
        end: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// A hinge names edges that do not meet in exactly one node.
    #[error("hinges[{hinge}]: ({first}, {second}) is not allowed; must be two edges that share exactly one node")]
    Hinge {
        /// Index of the hinge.
        hinge: usize,
        /// Its first edge.
        first: usize,
        /// Its second edge.
        second: usize,
    },
}

/// A bending and twisting joint between two edges that meet at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// The two edges.
    pub edges: [usize; 2],
    /// Far end of the first edge, the shared node, far end of the second edge.
    pub nodes: [usize; 3],
    /// `+1` where the edge runs along first-shared-last, `-1` where it runs against it. A reversed edge has tangent
    /// `-t`, directors `(m1, -m2)` and angle `-theta`.
    pub signs: [f64; 2],
}

/// Nodes, edges and hinges, and where each of their degrees of freedom stands.
///
/// The numbering interleaves `x0 y0 z0 theta0 x1 ...`: every edge's angle follows its lower-numbered node, so that the
/// elastic Hessian of a chain is banded.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    node_count: usize,
    edges: Vec<[usize; 2]>,
    hinges: Vec<Hinge>,
    node_dofs: Vec<usize>,
    edge_dofs: Vec<usize>,
}

impl Network {
    /// Builds a network from edges (pairs of nodes) and hinges (pairs of edges).
    ///
    /// # Errors
    /// [`NetworkError`] naming the edge or hinge that is not valid.
    pub fn new(node_count: usize, edges: &[[usize; 2]], hinges: &[[usize; 2]]) -> Result<Self, NetworkError> {
        for (edge, &[start, end]) in edges.iter().enumerate() {
            if start >= node_count || end >= node_count || start == end {
                return Err(NetworkError::Edge { edge, start, end, nodes: node_count });
            }
        }
        let hinges = hinges
            .iter()
            .enumerate()
            .map(|(hinge, &[first, second])| {
                join(edges, first, second).ok_or(NetworkError::Hinge { hinge, first, second })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let (node_dofs, edge_dofs) = number(node_count, edges);
        Ok(Self { node_count, edges: edges.to_vec(), hinges, node_dofs, edge_dofs })
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.node_count
    }

    /// Edges as pairs of nodes.
    pub fn edges(&self) -> &[[usize; 2]] {
        &self.edges
    }

    /// Hinges between edges.
    pub fn hinges(&self) -> &[Hinge] {
        &self.hinges
    }

    /// Number of degrees of freedom: three per node, one per edge.
    pub fn dof_count(&self) -> usize {
        3 * self.node_count + self.edges.len()
    }

    /// First of the three degrees of freedom of every node.
    pub fn node_dofs(&self) -> &[usize] {
        &self.node_dofs
    }

    /// Degree of freedom of every edge's angle.
    pub fn edge_dofs(&self) -> &[usize] {
        &self.edge_dofs
    }

    /// The other edges and nodes reached from a node: `(edge, node)` pairs.
    pub fn neighbours(&self, node: usize) -> Vec<(usize, usize)> {
        self.edges
            .iter()
            .enumerate()
            .filter_map(|(edge, &[start, end])| match node {
                _ if node == start => Some((edge, end)),
                _ if node == end => Some((edge, start)),
                _ => None,
            })
            .collect()
    }
}

fn number(node_count: usize, edges: &[[usize; 2]]) -> (Vec<usize>, Vec<usize>) {
    let mut following = vec![Vec::new(); node_count];
    for (edge, &[start, end]) in edges.iter().enumerate() {
        following[start.min(end)].push(edge);
    }
    let mut node_dofs = Vec::with_capacity(node_count);
    let mut edge_dofs = vec![0; edges.len()];
    let mut next = 0;
    for followers in following {
        node_dofs.push(next);
        next += 3;
        for edge in followers {
            edge_dofs[edge] = next;
            next += 1;
        }
    }
    (node_dofs, edge_dofs)
}

fn join(edges: &[[usize; 2]], first: usize, second: usize) -> Option<Hinge> {
    let (&[a, b], &[c, d]) = (edges.get(first)?, edges.get(second)?);
    if first == second {
        return None;
    }
    let mut candidates = Vec::new();
    for (far_a, shared_a, sign_a) in [(a, b, 1.0), (b, a, -1.0)] {
        for (shared_b, far_b, sign_b) in [(c, d, 1.0), (d, c, -1.0)] {
            if shared_a == shared_b {
                candidates.push(Hinge {
                    edges: [first, second],
                    nodes: [far_a, shared_a, far_b],
                    signs: [sign_a, sign_b],
                });
            }
        }
    }
    (candidates.len() == 1).then(|| candidates[0])
}
