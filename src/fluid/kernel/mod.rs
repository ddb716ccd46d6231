//! What the boundary of a fluid adds to the flow of its sources: images behind a plane.
//!
//! The flow of a force near a boundary is that of the force in unbounded fluid, [`super::segment`], plus one without
//! singularities in the fluid: the image. Blocks of images need not be symmetric.
//!
//! * [`no_slip`], [`free_surface`]: the image of a point force, a file for each kind of boundary.
//! * [`image_segment`]: the image of a straight segment, by quadrature with a known error.
//! * [`network`]: matrix and flow of the images of a whole network.
//!
//! A new kind of boundary is a file that implements `PointImage`, and a variant of [`Boundary`].

pub mod free_surface;
pub mod image_segment;
pub mod network;
pub mod no_slip;

use super::lanes::Lanes;
use crate::plane::Plane;
use crate::{Mat3, Vec3};
use free_surface::FreeSurface;
use no_slip::NoSlip;

/// A 3x3 block, row by row: the row is the component of the velocity, the column that of the force.
pub(crate) type Block<L> = [L; 9];

/// The image of a point force behind a plane.
pub(crate) trait PointImage: Copy + Send + Sync {
    /// The block `G` of `8 pi mu u = G f`, 1/m.
    ///
    /// `apart` is the vector from the mirrored source to the target (m), `heights` those of target and source above the plane
    /// (m), `epsilon_squared` the squared regularization length (m^2).
    fn block<L: Lanes>(&self, apart: [L; 3], heights: [L; 2], epsilon_squared: L) -> Block<L>;
}

/// A boundary of the fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary {
    /// A plane on which the fluid is at rest.
    NoSlip(Plane),
    /// A flat surface that bears no shear and that nothing crosses.
    FreeSurface(Plane),
}

impl Boundary {
    /// Where it is.
    pub fn plane(&self) -> &Plane {
        match self {
            Self::NoSlip(plane) | Self::FreeSurface(plane) => plane,
        }
    }

    /// The block (1/m) that the image adds to the flow at `target` of a point force at `source`, spread over `epsilon`; all m.
    ///
    /// Both must be on the fluid's side.
    pub fn point_image(&self, target: &Vec3, source: &Vec3, epsilon: f64) -> Mat3 {
        let plane = self.plane();
        let apart = (target - plane.mirror(source)).into();
        let heights = [plane.height(target), plane.height(source)];
        // On the scalar path of any processor: these blocks are for tests and single points.
        let block = match self {
            Self::NoSlip(_) => scalar_block(&NoSlip::new(plane), apart, heights, epsilon),
            Self::FreeSurface(_) => scalar_block(&FreeSurface::new(plane), apart, heights, epsilon),
        };
        Mat3::from_row_slice(&block)
    }
}

fn scalar_block(kernel: &impl PointImage, apart: [f64; 3], heights: [f64; 2], epsilon: f64) -> Block<f64> {
    use super::lanes::{Kernel, MOST_LANES, Path};

    struct One<'a, K> {
        kernel: &'a K,
        apart: [f64; 3],
        heights: [f64; 2],
        epsilon: f64,
        out: &'a mut Block<f64>,
    }

    impl<K: PointImage> Kernel for One<'_, K> {
        #[inline(always)]
        fn run<L: Lanes>(self) {
            let square = L::splat(self.epsilon * self.epsilon);
            let block = self.kernel.block(self.apart.map(L::splat), self.heights.map(L::splat), square);
            for k in 0..9 {
                let mut lanes = [0.0; MOST_LANES];
                block[k].store(&mut lanes);
                self.out[k] = lanes[0];
            }
        }
    }

    let mut out = [0.0; 9];
    Path::chosen().run(One { kernel, apart, heights, epsilon, out: &mut out });
    out
}
