//! The head's term: what it says of rigid turns about any axis, and its derivative against central differences.

mod common;

use common::{Random, chain_edges, chain_hinges};
use flagrs::Vec3;
use flagrs::fluid::head::Head;
use flagrs::linear::pattern::Pattern;
use flagrs::rod::assembly::{Assembly, Increment};
use flagrs::rod::configuration::{Configuration, node};
use flagrs::rod::network::Network;
use flagrs::rod::reference::ReferenceFrames;
use flagrs::rod::term::{External, Term};

const TRANSLATION: f64 = 1.7;
const ROTATION: f64 = 0.6;

/// A head on the middle node of three, or four with a branch; the last edge runs against the others.
struct Setting {
    network: Network,
    frames: ReferenceFrames,
    q: Vec<f64>,
    head: Head,
    pattern: Pattern,
}

fn setting(nodes: &[Vec3]) -> Setting {
    let (mut edges, mut hinges) = (chain_edges(3), chain_hinges(3));
    if nodes.len() == 4 {
        edges.push([3, 1]);
        hinges.push([1, 2]);
    }
    let network = Network::new(nodes.len(), &edges, &hinges).unwrap();
    let lengths: Vec<f64> = edges.iter().map(|&[i, j]| (nodes[j] - nodes[i]).norm()).collect();
    let mut head = Head::new(&network, 1, (0..edges.len()).collect(), &lengths, [TRANSLATION, ROTATION]);
    let stencils = head.stencils();
    let pattern = Pattern::from_stencils(network.dof_count(), stencils.iter().map(Vec::as_slice));
    head.bind(&pattern);
    let mut q = vec![0.0; network.dof_count()];
    for (position, &dof) in nodes.iter().zip(network.node_dofs()) {
        q[dof..dof + 3].copy_from_slice(position.as_slice());
    }
    let frames = ReferenceFrames::of_shape(&network, nodes, &|_| None);
    Setting { network, frames, q, head, pattern }
}

impl Setting {
    /// Residual and derivative at `q` with rates `rate (q - previous) + drift`.
    fn evaluate(&self, q: &[f64], rate: f64, previous: &[f64], drift: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut configuration = Configuration::new(&self.network, q.len());
        assert!(configuration.update(&self.network, q, &self.frames, &[]));
        let increment = Increment {
            time: 0.0,
            rate,
            previous,
            drift,
            velocity: drift,
            velocity_drift: drift,
            inputs: &[],
            motor_torques: &[],
            background: None,
        };
        let (mut residual, mut jacobian) = (vec![0.0; q.len()], vec![0.0; self.pattern.entries()]);
        let mut out = Assembly { residual: &mut residual, jacobian: Some(&mut jacobian) };
        self.head.add(&configuration, &increment, &mut out).expect("the head resists");
        let mut alone = vec![0.0; q.len()];
        self.head
            .add(&configuration, &increment, &mut Assembly { residual: &mut alone, jacobian: None })
            .expect("the head resists");
        assert_eq!(residual, alone, "the residual depends on whether the derivative is asked for");
        (residual, jacobian)
    }

    /// Rates of a rigid turn about the head's node.
    fn rigid(&self, omega: &Vec3) -> Vec<f64> {
        let centre = node(&self.q, self.network.node_dofs()[1]);
        let mut rates = vec![0.0; self.q.len()];
        for &dof in self.network.node_dofs() {
            rates[dof..dof + 3].copy_from_slice(omega.cross(&(node(&self.q, dof) - centre)).as_slice());
        }
        for (&[i, j], &dof) in self.network.edges().iter().zip(self.network.edge_dofs()) {
            let [i, j] = [i, j].map(|k| node(&self.q, self.network.node_dofs()[k]));
            rates[dof] = omega.dot(&(j - i).normalize());
        }
        rates
    }
}

fn shapes(random: &mut Random) -> Vec<Vec<Vec3>> {
    let straight = vec![Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), Vec3::new(2.5, 0.0, 0.0)];
    let bent = vec![Vec3::zeros(), Vec3::new(1.0, 0.2, 0.1), Vec3::new(1.3, 1.1, -0.4)];
    let mut branched = bent.clone();
    branched.push(bent[1] + Vec3::new(0.2, -0.3, 0.8) + random.vector(0.1));
    vec![straight, bent, branched]
}

#[test]
fn a_rigid_turn_about_any_axis_meets_the_full_couple() {
    let mut random = Random::new(3);
    for nodes in shapes(&mut random) {
        let setting = setting(&nodes);
        let tangent = (nodes[1] - nodes[0]).normalize();
        for omega in [tangent, Vec3::x(), Vec3::y(), Vec3::z(), random.vector(1.0)] {
            let rates = setting.rigid(&omega);
            let (residual, _) = setting.evaluate(&setting.q, 1.0, &setting.q, &rates);
            let power: f64 = residual.iter().zip(&rates).map(|(force, rate)| force * rate).sum();
            let expected = ROTATION * omega.norm_squared();
            assert!((power - expected).abs() < 1e-13 * expected, "power {power} about {omega:?}, not {expected}");
            // Any other virtual turn: the couple is along omega.
            let other = random.vector(1.0);
            let work: f64 = residual.iter().zip(setting.rigid(&other)).map(|(force, rate)| force * rate).sum();
            assert!((work - ROTATION * omega.dot(&other)).abs() < 1e-13, "work {work}");
        }
    }
}

#[test]
fn a_moved_head_meets_its_drag_alone() {
    let mut random = Random::new(5);
    for nodes in shapes(&mut random) {
        let setting = setting(&nodes);
        let velocity = random.vector(1.0);
        let mut rates = vec![0.0; setting.q.len()];
        for &dof in setting.network.node_dofs() {
            rates[dof..dof + 3].copy_from_slice(velocity.as_slice());
        }
        let (residual, _) = setting.evaluate(&setting.q, 1.0, &setting.q, &rates);
        for (k, &dof) in setting.network.node_dofs().iter().enumerate() {
            let expected = if k == 1 { velocity * TRANSLATION } else { Vec3::zeros() };
            assert!((node(&residual, dof) - expected).norm() < 1e-14, "node {k}");
        }
    }
}

#[test]
fn the_derivative_is_exact_at_and_away_from_the_reference() {
    let mut random = Random::new(7);
    for (nodes, displacement) in shapes(&mut random).into_iter().flat_map(|nodes| [(nodes.clone(), 0.0), (nodes, 0.2)])
    {
        let setting = setting(&nodes);
        let mut noise = |size: f64| setting.q.iter().map(|_| size * random.uniform()).collect::<Vec<f64>>();
        let (moved, drift) = (noise(displacement), noise(1.0));
        let q: Vec<f64> = setting.q.iter().zip(moved).map(|(q, moved)| q + moved).collect();
        let rate = 2.3;
        let (_, jacobian) = setting.evaluate(&q, rate, &setting.q, &drift);
        let h = 1e-5;
        for column in 0..q.len() {
            let at = |shift: f64| {
                let mut shifted = q.clone();
                shifted[column] += shift;
                setting.evaluate(&shifted, rate, &setting.q, &drift).0
            };
            let (above, below) = (at(h), at(-h));
            for row in 0..q.len() {
                let expected = (above[row] - below[row]) / (2.0 * h);
                let found = setting.pattern.slot(row, column).map_or(0.0, |slot| jacobian[slot]);
                // Central differences: round-off of 1e-16 / h, and a third derivative of order ten times h^2.
                assert!((found - expected).abs() < 3e-8, "({row}, {column}): {found}, not {expected}");
            }
        }
    }
}
