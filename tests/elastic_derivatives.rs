//! Gradient and Hessian of the elastic energy against central differences, at and away from the reference frames.

mod common;

use common::{Random, scene};
use flagrs::Vec3;
use flagrs::model::specification::{MotorSpecification, Specification};
use flagrs::signal::Signal;
use flagrs::simulation::Simulation;
use flagrs::step::scheme::Scheme;

/// A chain with two motors, a section that is not round, natural curvature and twist, and two branches, one of whose
/// edges runs against its hinges.
fn branching_network(random: &mut Random) -> Specification {
    let mut nodes: Vec<Vec3> = (0..7).map(|k| Vec3::new(k as f64, 0.0, 0.0) + random.vector(0.3)).collect();
    nodes.push(nodes[3] + Vec3::new(0.3, 1.0, 0.2));
    nodes.push(nodes[7] + Vec3::new(0.1, 0.9, -0.4));
    nodes.push(nodes[3] + Vec3::new(-0.2, -0.3, 1.1));
    let edges = vec![[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [7, 3], [7, 8], [3, 9]];
    let hinges = vec![[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [2, 6], [6, 3], [6, 7], [8, 2], [8, 6]];
    let mut specification = scene(nodes, edges, hinges);
    specification.rest_nodes.iter_mut().for_each(|node| *node += random.vector(0.1));
    specification.theta.iter_mut().for_each(|theta| *theta = random.uniform());
    specification.bending.iter_mut().for_each(|ei| *ei = [[2.0, 0.4], [0.4, 1.1]]);
    specification.natural_curvature[3] = Some([0.2, -0.5]);
    specification.natural_twist[4] = Some(0.7);
    specification
}

fn motor(hinge: usize, shaft_second: bool, by_torque: bool) -> MotorSpecification {
    MotorSpecification { hinge, shaft_second, by_torque, signal: Signal::Constant(1.0) }
}

/// Central differences, extrapolated once: error of order h^4.
fn difference(
    sim: &mut Simulation,
    q: &[f64],
    dof: usize,
    h: f64,
    value: &mut dyn FnMut(&mut Simulation) -> Vec<f64>,
) -> Vec<f64> {
    let mut at = |shift: f64, sim: &mut Simulation| {
        let mut moved = q.to_vec();
        moved[dof] += shift;
        let mut state = sim.state().clone();
        state.q = moved;
        sim.restore(state);
        value(sim)
    };
    let wide: Vec<f64> = at(h, sim).iter().zip(at(-h, sim)).map(|(a, b)| (a - b) / (2.0 * h)).collect();
    let narrow: Vec<f64> = at(0.5 * h, sim).iter().zip(at(-0.5 * h, sim)).map(|(a, b)| (a - b) / h).collect();
    let mut state = sim.state().clone();
    state.q = q.to_vec();
    sim.restore(state);
    narrow.iter().zip(&wide).map(|(n, w)| (4.0 * n - w) / 3.0).collect()
}

fn dense(sim: &Simulation, values: &[f64]) -> Vec<Vec<f64>> {
    let pattern = sim.model().pattern();
    let n = pattern.size();
    let mut out = vec![vec![0.0; n]; n];
    for column in 0..n {
        for k in pattern.column_starts()[column]..pattern.column_starts()[column + 1] {
            out[column][pattern.row_indices()[k]] = values[k];
        }
    }
    out
}

fn check(specification: Specification, random: &mut Random, displacement: f64, motor_turns: f64) {
    let mut sim = Simulation::new(specification, Scheme::Overdamped, 1e-2, 1).unwrap();
    let mut state = sim.state().clone();
    state.motor_angles.iter_mut().for_each(|angle| *angle = motor_turns * std::f64::consts::TAU + 0.4);
    for value in &mut state.q {
        *value += displacement * random.uniform();
    }
    // A free motor angle takes part in q; wind it up together with its shaft.
    let first_free = sim.model().network().dof_count();
    for dof in first_free..sim.model().dof_count() {
        state.q[dof] += motor_turns * std::f64::consts::TAU;
    }
    for motor in [0usize, 4] {
        let dof = sim.model().network().edge_dofs()[motor];
        state.q[dof] += if motor == 0 { -1.0 } else { 1.0 } * motor_turns * std::f64::consts::TAU;
    }
    let q = state.q.clone();
    sim.restore(state);
    let (gradient, hessian) = sim.elastic_derivatives().expect("a configuration");
    let hessian = dense(&sim, &hessian);
    let scale = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
    let hessian_scale = hessian.iter().flatten().fold(0.0_f64, |m, g| m.max(g.abs()));
    for dof in 0..q.len() {
        let energy =
            difference(&mut sim, &q, dof, 2e-3, &mut |sim| vec![sim.energies().iter().map(|(_, energy)| energy).sum()]);
        let error = (energy[0] - gradient[dof]).abs() / scale;
        assert!(error < 1e-8, "gradient of dof {dof}: {} against {}, relative {error:.1e}", gradient[dof], energy[0]);
        let column =
            difference(&mut sim, &q, dof, 1e-3, &mut |sim| sim.elastic_derivatives().expect("a configuration").0);
        for (row, value) in column.iter().enumerate() {
            let error = (value - hessian[dof][row]).abs() / hessian_scale;
            assert!(
                error < 1e-8,
                "Hessian ({row}, {dof}): {} against {value}, relative {error:.1e}",
                hessian[dof][row]
            );
        }
    }
}

#[test]
fn derivatives_agree_with_differences_at_the_reference_frames() {
    let mut random = Random::new(1);
    for _ in 0..3 {
        let specification = branching_network(&mut random);
        check(specification, &mut random, 0.0, 0.0);
    }
}

#[test]
fn derivatives_agree_with_differences_away_from_the_reference_frames() {
    let mut random = Random::new(2);
    for _ in 0..3 {
        let specification = branching_network(&mut random);
        check(specification, &mut random, 0.25, 0.0);
    }
}

#[test]
fn derivatives_agree_with_differences_with_motors_turned_a_thousand_times() {
    let mut random = Random::new(3);
    for by_torque in [false, true] {
        let mut specification = branching_network(&mut random);
        specification.motors = vec![motor(0, false, by_torque), motor(3, true, by_torque)];
        check(specification, &mut random, 0.2, 1000.0);
    }
}

#[test]
fn derivatives_agree_with_differences_at_any_twist() {
    let mut random = Random::new(4);
    for twist in [0.3, 1.0, 2.0, 3.1, 3.2, 50.0] {
        let mut specification = branching_network(&mut random);
        wind(&mut specification, twist);
        // Near its natural twist a hinge twists little, and bending is not small beside it.
        specification.natural_twist.iter_mut().for_each(|natural| *natural = Some(twist + 0.7));
        check(specification, &mut random, 0.2, 0.0);
    }
}

/// Turns each edge of the chain by `twist` against the one before it; branches stay.
fn wind(specification: &mut Specification, twist: f64) {
    for edge in 0..6 {
        specification.theta[edge] += edge as f64 * twist;
    }
}

/// Bending energy of a bent, naturally straight chain of round sections whose hinges are twisted by `twist`; with one edge
/// `turned`, it runs against its hinges.
fn bending_energy(twist: f64, turned: bool) -> f64 {
    let mut random = Random::new(5);
    let straight: Vec<Vec3> = (0..7).map(|k| Vec3::new(k as f64, 0.0, 0.0)).collect();
    let mut edges = common::chain_edges(7);
    if turned {
        edges[2] = [3, 2];
    }
    let mut specification = scene(straight.clone(), edges, common::chain_hinges(7));
    specification.nodes = straight.iter().map(|node| node + random.vector(0.8)).collect();
    specification.directors = vec![(0, Vec3::new(0.1, 0.2, 1.0))];
    wind(&mut specification, twist);
    if turned {
        specification.theta[2] *= -1.0;
    }
    Simulation::new(specification, Scheme::Overdamped, 1e-2, 1).unwrap().energies()[1].1
}

#[test]
fn bending_energy_of_round_sections_does_not_depend_on_twist() {
    let untwisted = bending_energy(0.0, false);
    assert!(untwisted > 0.1);
    for twist in [1e-3, 0.3, 1.0, 2.0, 3.1, std::f64::consts::PI, 3.2, 6.3, 50.0, 3000.0] {
        for turned in [false, true] {
            let error = (bending_energy(twist, turned) / untwisted - 1.0).abs();
            assert!(error < 1e-14, "twist {twist}: bending energy changes by {error:.1e}");
        }
    }
}

/// A hinge with a section that is not round and natural curvature, wherever its middle frame stands.
#[test]
fn curvature_is_measured_in_the_frame_halfway_through_the_twist() {
    let bend = 0.7_f64;
    let size = 2.0 * (0.5 * bend).tan();
    for twist in [0.0, 0.4, 3.0, 3.3, 6.0, 9.0] {
        let nodes = vec![Vec3::zeros(), Vec3::x(), Vec3::new(1.0 + bend.cos(), bend.sin(), 0.0)];
        let mut specification = scene(nodes, common::chain_edges(3), common::chain_hinges(3));
        // The binormal is z, the first edge's director too.
        specification.directors = vec![(0, Vec3::z())];
        specification.theta = vec![0.3, 0.3 + twist];
        specification.bending = vec![[[2.0, 0.4], [0.4, 1.1]]];
        specification.natural_curvature = vec![Some([0.2, -0.5])];
        let found = Simulation::new(specification, Scheme::Overdamped, 1e-2, 1).unwrap().energies()[1].1;
        // The middle frame stands at 0.3 + twist / 2 from the binormal: kappa = |kb| (m2 . b, -m1 . b).
        let middle = 0.3 + 0.5 * twist;
        let (d1, d2) = (-size * middle.sin() - 0.2, -size * middle.cos() + 0.5);
        let expected = 0.5 * (2.0 * d1 * d1 + 0.8 * d1 * d2 + 1.1 * d2 * d2);
        assert!((found / expected - 1.0).abs() < 1e-13, "twist {twist}: {found} against {expected}");
    }
}
