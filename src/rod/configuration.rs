//! Everything about a trial state that several terms need, computed once per evaluation and without allocation.

use super::frames::{FOLDED, Holonomy, one_plus_cosine, orthonormalised, reference_twist, transport_through};
use super::network::Network;
use super::reference::ReferenceFrames;
use super::strain::{EdgeFrame, HingeStrain};
use crate::Vec3;

/// The angle by which a motor has turned the shaft edge of a hinge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftAngle {
    /// Index of the hinge.
    pub hinge: usize,
    /// Whether the shaft is the hinge's second edge.
    pub second: bool,
    /// Angle of the shaft against its housing about the hinge's direction, rad.
    pub angle: f64,
}

/// Edge frames and hinge strains of a trial state.
#[derive(Debug, Clone)]
pub struct Configuration {
    vectors: Vec<Vec3>,
    lengths: Vec<f64>,
    tangents: Vec<Vec3>,
    directors: Vec<Vec3>,
    material: Vec<[Vec3; 2]>,
    holonomies: Vec<Holonomy>,
    twists: Vec<f64>,
    strains: Vec<HingeStrain>,
    q: Vec<f64>,
}

impl Configuration {
    /// Room for the states of a network with `dof_count` degrees of freedom in all.
    pub fn new(network: &Network, dof_count: usize) -> Self {
        let (edges, hinges) = (network.edges().len(), network.hinges().len());
        let zero = Vec3::zeros();
        let frame = EdgeFrame { t: Vec3::x(), m1: Vec3::y(), m2: Vec3::z(), length: 1.0 };
        Self {
            vectors: vec![zero; edges],
            lengths: vec![0.0; edges],
            tangents: vec![zero; edges],
            directors: vec![zero; edges],
            material: vec![[zero; 2]; edges],
            holonomies: vec![Holonomy::NONE; edges],
            twists: vec![0.0; hinges],
            strains: vec![HingeStrain::new(frame, frame, 0.0); hinges],
            q: vec![0.0; dof_count],
        }
    }

    /// Moves to the state `q`, with frames transported from `reference` and shafts turned by their motors.
    ///
    /// Returns false, and leaves the configuration unusable, if an edge has no length, a coordinate is not finite, or two
    /// edges of a hinge have folded onto each other.
    pub fn update(&mut self, network: &Network, q: &[f64], reference: &ReferenceFrames, shafts: &[ShaftAngle]) -> bool {
        self.q.copy_from_slice(q);
        for (k, &[i, j]) in network.edges().iter().enumerate() {
            let vector = node(q, network.node_dofs()[j]) - node(q, network.node_dofs()[i]);
            let length = vector.norm();
            if !(length > 0.0 && length.is_finite()) {
                return false;
            }
            let t = vector / length;
            let old = &reference.tangents[k];
            // An edge that has not turned keeps its director to the last bit.
            let director = if *old == t {
                reference.directors[k]
            } else {
                orthonormalised(&transport_through(&reference.directors[k], old, &t), &t)
            };
            let second = t.cross(&director);
            let (sine, cosine) = q[network.edge_dofs()[k]].sin_cos();
            self.vectors[k] = vector;
            self.lengths[k] = length;
            self.tangents[k] = t;
            self.directors[k] = director;
            self.material[k] = [director * cosine + second * sine, second * cosine - director * sine];
            self.holonomies[k] = if *old == t || one_plus_cosine(old, &t) < FOLDED {
                Holonomy::NONE
            } else {
                Holonomy::new(old, &t, length)
            };
        }
        for k in 0..network.hinges().len() {
            let [e, f] = self.hinge_frames(network, k);
            if one_plus_cosine(&e.t, &f.t) < FOLDED {
                return false;
            }
            let hinge = network.hinges()[k];
            let [director_e, director_f] = hinge.edges.map(|edge| self.directors[edge]);
            self.twists[k] = reference_twist(&director_e, &e.t, &director_f, &f.t, reference.twists[k]);
            let theta = |side: usize| hinge.signs[side] * q[network.edge_dofs()[hinge.edges[side]]];
            self.strains[k] = HingeStrain::new(e, f, theta(1) - theta(0) + self.twists[k]);
        }
        for shaft in shafts {
            let [e, f] = self.hinge_frames(network, shaft.hinge);
            let tau = self.strains[shaft.hinge].tau - shaft.angle;
            self.strains[shaft.hinge] = if shaft.second {
                HingeStrain::new(e, f.turned((-shaft.angle).sin_cos()), tau)
            } else {
                HingeStrain::new(e.turned(shaft.angle.sin_cos()), f, tau)
            };
        }
        true
    }

    /// Material frames of a hinge's two edges as the hinge sees them.
    #[inline]
    fn hinge_frames(&self, network: &Network, hinge: usize) -> [EdgeFrame; 2] {
        let hinge = network.hinges()[hinge];
        [self.frame(hinge.edges[0], hinge.signs[0]), self.frame(hinge.edges[1], hinge.signs[1])]
    }

    fn frame(&self, edge: usize, sign: f64) -> EdgeFrame {
        let [m1, m2] = self.material[edge];
        EdgeFrame { t: self.tangents[edge] * sign, m1, m2: m2 * sign, length: self.lengths[edge] }
    }

    /// Degrees of freedom of the state.
    pub fn q(&self) -> &[f64] {
        &self.q
    }

    /// Edge vector, m.
    pub fn vector(&self, edge: usize) -> Vec3 {
        self.vectors[edge]
    }

    /// Edge length, m.
    pub fn length(&self, edge: usize) -> f64 {
        self.lengths[edge]
    }

    /// Unit tangent.
    pub fn tangent(&self, edge: usize) -> Vec3 {
        self.tangents[edge]
    }

    /// Material directors `m1, m2`.
    pub fn material(&self, edge: usize) -> [Vec3; 2] {
        self.material[edge]
    }

    /// Spin of the reference frame of an edge.
    pub fn holonomy(&self, edge: usize) -> Holonomy {
        self.holonomies[edge]
    }

    /// Strains of a hinge.
    pub fn strain(&self, hinge: usize) -> &HingeStrain {
        &self.strains[hinge]
    }

    /// Makes this configuration the reference of the next step.
    pub fn accept(&self, reference: &mut ReferenceFrames) {
        reference.tangents.copy_from_slice(&self.tangents);
        reference.directors.copy_from_slice(&self.directors);
        reference.twists.copy_from_slice(&self.twists);
    }
}

/// Reads three consecutive coordinates.
#[inline]
pub fn node(q: &[f64], dof: usize) -> Vec3 {
    Vec3::new(q[dof], q[dof + 1], q[dof + 2])
}
