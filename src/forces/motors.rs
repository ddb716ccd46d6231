//! Motors: a hinge whose shaft edge turns against its housing edge.
//!
//! Lim et al. take the motor angle off the twist only (equation 4). The bending energy of the hinge would then carry a
//! factor `cos^2(phi/2)`, and the joint would lose its bending stiffness once a turn; here the shaft's material frame
//! is turned back by the motor angle in curvature and twist alike ([`crate::rod::configuration::Configuration::update`]).

use crate::linear::pattern::Pattern;
use crate::rod::assembly::{Assembly, Increment};
use crate::rod::configuration::{Configuration, ShaftAngle};
use crate::rod::strain::{THETA_E, THETA_F};
use crate::rod::term::{External, Purpose, Term, TermError};

/// What drives a motor.
#[derive(Debug, Clone)]
pub enum Drive {
    /// Relative angular velocity of shaft and housing, rad/s.
    Speed,
    /// Torque of the motor on the shaft, N m; the angle follows from equilibrium and is a degree of freedom.
    Torque {
        /// Degree of freedom of the angle.
        dof: usize,
    },
}

/// A motor at a hinge.
#[derive(Debug, Clone)]
pub struct Motor {
    /// Index of the hinge.
    pub hinge: usize,
    /// Whether the shaft is the hinge's second edge.
    pub shaft_second: bool,
    /// What drives it.
    pub drive: Drive,
}

impl Motor {
    /// Row and sign of the edge angle that a free motor angle acts like in the hinge's variables.
    pub fn angle_row(shaft_second: bool) -> (usize, f64) {
        if shaft_second { (THETA_F, -1.0) } else { (THETA_E, 1.0) }
    }

    /// The shaft's angle: prescribed, or read from the degrees of freedom.
    pub fn shaft(&self, prescribed: f64, q: &[f64]) -> ShaftAngle {
        let angle = match self.drive {
            Drive::Speed => prescribed,
            Drive::Torque { dof } => q[dof],
        };
        ShaftAngle { hinge: self.hinge, second: self.shaft_second, angle }
    }

    /// Torque on the shaft, N m, from the derivative of the hinge's energy with respect to its two angles.
    pub fn torque(&self, moments: [f64; 2]) -> f64 {
        if self.shaft_second { -moments[1] } else { moments[0] }
    }
}

/// Torques of motors on the angles of their shafts, where these are degrees of freedom.
pub struct MotorTorques {
    /// Degree of freedom of every motor's angle; none where its speed is given.
    dofs: Vec<Option<usize>>,
}

impl MotorTorques {
    /// Those of the motors whose torque is given; `None` if there is none.
    pub fn new(motors: &[Motor]) -> Option<Self> {
        let dof = |motor: &Motor| match motor.drive {
            Drive::Torque { dof } => Some(dof),
            Drive::Speed => None,
        };
        let dofs: Vec<Option<usize>> = motors.iter().map(dof).collect();
        dofs.iter().any(Option::is_some).then_some(Self { dofs })
    }
}

impl Term for MotorTorques {
    fn name(&self) -> &'static str {
        "motor torques"
    }

    fn stencils(&self) -> Vec<Vec<usize>> {
        Vec::new()
    }

    fn bind(&mut self, _: &Pattern) {}
}

impl External for MotorTorques {
    fn purpose(&self) -> Purpose {
        Purpose::Motor
    }

    fn add(&self, _: &Configuration, increment: &Increment, out: &mut Assembly) -> Result<(), TermError> {
        for (dof, torque) in self.dofs.iter().zip(increment.motor_torques) {
            if let Some(dof) = dof {
                out.residual[*dof] -= torque;
            }
        }
        Ok(())
    }
}
