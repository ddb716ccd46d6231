//! Images of point forces and segments behind a plane: against high-precision quadrature, and by what defines them.

use flagrs::fluid::kernel::Boundary;
use flagrs::fluid::kernel::network::Segments;
use flagrs::fluid::stokeslet::{mobility, velocity};
use flagrs::plane::Plane;
use flagrs::{Mat3, Vec3};

fn tilted() -> Plane {
    Plane::new(Vec3::new(0.3, -0.2, 0.1), Vec3::new(1.0, 2.0, -2.0)).expect("a plane")
}

/// A deterministic sequence of numbers in [0, 1).
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 12_345_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A point at a height above the plane, somewhere within a unit.
fn above(plane: &Plane, height: f64, next: &mut impl FnMut() -> f64) -> Vec3 {
    let at = Vec3::from_fn(|_, _| 2.0 * next() - 1.0);
    at + plane.normal() * (height - plane.height(&at))
}

/// The flow of a regularized point force in unbounded fluid.
fn stokeslet(r: &Vec3, epsilon: f64) -> Mat3 {
    let inverse = 1.0 / (r.norm_squared() + epsilon * epsilon).sqrt();
    let cube = inverse.powi(3);
    Mat3::identity() * (inverse + epsilon * epsilon * cube) + r * r.transpose() * cube
}

fn total(boundary: &Boundary, target: &Vec3, source: &Vec3, epsilon: f64) -> Mat3 {
    stokeslet(&(target - source), epsilon) + boundary.point_image(target, source, epsilon)
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool")
}

#[test]
fn segment_images_agree_with_high_precision_quadrature() {
    let mut worst = [("", 0.0_f64); 2];
    let mut count = 0;
    for line in include_str!("data/wall_blocks.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let v: Vec<f64> = fields[2..].iter().map(|n| n.parse().expect("a number")).collect();
        assert_eq!(v.len(), 34, "{line}");
        let vector = |k: usize| Vec3::from_column_slice(&v[3 * k..3 * k + 3]);
        let plane = Plane::new(vector(0), vector(1)).expect("a plane");
        let (kind, boundary) = match fields[0] {
            "no-slip" => (0, Boundary::NoSlip(plane)),
            _ => (1, Boundary::FreeSurface(plane)),
        };
        let (target, nodes) = ([vector(2)], [vector(3), vector(4)]);
        let mut matrix = [0.0; 18];
        let segments = Segments { nodes: &nodes, edges: &[[0, 1]], epsilon: &[v[15]] };
        boundary.add_to_mobility(segments, &target, &mut matrix, None);
        for block in 0..2 {
            let reference = Mat3::from_row_slice(&v[16 + 9 * block..25 + 9 * block]);
            let value = Mat3::from_column_slice(&matrix[9 * block..9 * block + 9]);
            let error = (value - reference).amax() / reference.amax();
            if error > worst[kind].1 {
                worst[kind] = (fields[1], error);
            }
        }
        count += 1;
    }
    assert!(count >= 120, "only {count} cases");
    println!("{worst:?}");
    // The rules truncate at 1e-12; heights are known to the round-off of the plane's distance from the origin.
    assert!(worst.iter().all(|(_, error)| *error < 5e-12), "{worst:?}");
}

#[test]
fn the_fluid_is_at_rest_on_a_wall() {
    let (plane, mut next) = (tilted(), numbers());
    for _ in 0..200 {
        let (height, epsilon) = (10f64.powf(-2.0 + 3.0 * next()), 10f64.powf(-2.0 + 1.7 * next()));
        let (source, target) = (above(&plane, height, &mut next), above(&plane, 0.0, &mut next));
        let flow = total(&Boundary::NoSlip(plane), &target, &source, epsilon);
        assert!(flow.amax() < 1e-13 / epsilon, "{flow}");
    }
}

#[test]
fn nothing_crosses_a_free_surface_and_it_bears_no_shear() {
    let (plane, mut next) = (tilted(), numbers());
    let (boundary, n) = (Boundary::FreeSurface(plane), *plane.normal());
    let along = n.cross(&Vec3::x()).normalize();
    for _ in 0..50 {
        let (height, epsilon) = (0.1 + next(), 0.05 + 0.5 * next());
        let (source, target) = (above(&plane, height, &mut next), above(&plane, 0.0, &mut next));
        let flow = total(&boundary, &target, &source, epsilon);
        assert!((n.transpose() * flow).amax() < 1e-13 / epsilon);
        let step = 1e-4;
        // The flow above the surface is mirrored below, so differences across it are differences of the image's formula too.
        let up = total(&boundary, &(target + n * step), &source, epsilon);
        let down = total(&boundary, &(target - n * step), &source, epsilon);
        let shear = along.transpose() * (up - down) / (2.0 * step);
        assert!(shear.amax() < 1e-6 / epsilon.powi(2), "{shear}");
    }
}

#[test]
fn images_are_without_divergence_and_exchange_of_target_and_source_transposes_them() {
    let (plane, mut next) = (tilted(), numbers());
    for boundary in [Boundary::NoSlip(plane), Boundary::FreeSurface(plane)] {
        for _ in 0..100 {
            let epsilon = 0.02 + 0.3 * next();
            let heights = [0.05 + next(), 0.05 + next()];
            let [x, y] = heights.map(|height| above(&plane, height, &mut next));
            let block = boundary.point_image(&x, &y, epsilon);
            let exchanged = boundary.point_image(&y, &x, epsilon).transpose();
            assert!((block - exchanged).amax() < 1e-13 * block.amax());
            let step = 1e-4;
            let divergence: Vec3 = (0..3)
                .map(|c| {
                    let shift = Vec3::from_fn(|k, _| if k == c { step } else { 0.0 });
                    let change = boundary.point_image(&(x + shift), &y, epsilon)
                        - boundary.point_image(&(x - shift), &y, epsilon);
                    Vec3::from_column_slice(change.row(c).transpose().as_slice()) / (2.0 * step)
                })
                .sum();
            // Central differences err by step^2 times third derivatives, which reach block / height^3.
            let size = block.amax() * step * step / (heights[0] + heights[1]).powi(3);
            assert!(divergence.amax() < 100.0 * size + 1e-10, "{divergence} {size}");
        }
    }
}

#[test]
fn the_image_of_a_distant_plane_vanishes_like_the_flow_of_a_point_force() {
    // Lorentz (1907): a force at the height h is slowed by 9/16 along and 9/8 across the plane, over 6 pi mu h.
    let plane = Plane::new(Vec3::zeros(), Vec3::z()).expect("a plane");
    let height = 7.0;
    let at = Vec3::new(0.0, 0.0, height);
    let image = Boundary::NoSlip(plane).point_image(&at, &at, 1e-6) * (3.0 / 4.0 * height);
    let expected = Mat3::from_diagonal(&Vec3::new(-9.0 / 16.0, -9.0 / 16.0, -9.0 / 8.0));
    assert!((image - expected).amax() < 1e-12, "{image}");
}

#[test]
fn matrix_and_flow_agree_and_do_not_depend_on_threads() {
    let (plane, mut next) = (tilted(), numbers());
    let boundary = Boundary::NoSlip(plane);
    let mut heights = (0..60).map(|k| 0.02 + 0.01 * f64::from(k));
    let nodes: Vec<Vec3> = heights.by_ref().map(|height| above(&plane, height, &mut next)).collect();
    // A chain numbered both ways, a branch, and nodes without an edge.
    let mut edges: Vec<[usize; 2]> = (1..50).map(|k| if k % 3 == 0 { [k, k - 1] } else { [k - 1, k] }).collect();
    edges.push([20, 51]);
    let epsilon: Vec<f64> = (0..edges.len()).map(|k| 1e-2 * (1.0 + 0.1 * k as f64)).collect();
    let targets: Vec<Vec3> = (0..77).map(|k| above(&plane, 0.01 * f64::from(k), &mut next)).collect();
    let density: Vec<Vec3> = (0..nodes.len()).map(|_| Vec3::from_fn(|_, _| 2.0 * next() - 1.0)).collect();
    let segments = Segments { nodes: &nodes, edges: &edges, epsilon: &epsilon };
    let matrix_on = |threads: usize| {
        let pool = pool(threads);
        let mut matrix = vec![0.0; 9 * targets.len() * nodes.len()];
        mobility(&targets, &nodes, &edges, &epsilon, &mut matrix, Some(&pool));
        boundary.add_to_mobility(segments, &targets, &mut matrix, Some(&pool));
        matrix
    };
    let flow_on = |threads: usize| {
        let pool = pool(threads);
        let mut flow = vec![Vec3::zeros(); targets.len()];
        velocity(&targets, &nodes, &edges, &density, &epsilon, &mut flow, Some(&pool));
        boundary.add_to_velocity(segments, &density, &targets, &mut flow, Some(&pool));
        flow
    };
    let (matrix, flow) = (matrix_on(1), flow_on(1));
    assert!(matrix_on(3) == matrix && flow_on(3) == flow, "threads change results");
    let rows = 3 * targets.len();
    for row in 0..rows {
        let product: f64 =
            (0..3 * nodes.len()).map(|column| matrix[row + rows * column] * density[column / 3][column % 3]).sum();
        assert!((product - flow[row / 3][row % 3]).abs() < 1e-11, "row {row}");
    }
    // The first target is on the wall.
    assert!(flow[0].amax() < 1e-11 * flow[40].amax().max(1.0), "{}", flow[0]);
}
