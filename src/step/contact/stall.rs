//! What to say where contact has stalled.
//!
//! Contact far too soft or far too stiff for the forces it bears, or of a tolerance far too fine, lets a step be solved only where it is
//! minute: the run would not fail, and not end either.

use crate::contact::potential::{BarrierLaw, ContactForce};

/// What to say of a stall whose strongest contact is this.
pub(super) fn reason(law: &BarrierLaw, strongest: &ContactForce, iterations: u64, advanced: f64) -> String {
    let [a, b] = strongest.bodies;
    let pair = strongest.indices(law).map(|body| body as usize);
    let (force, stiffness) = (strongest.contact.force, law.stiffness(pair));
    let friction = if law.has_friction() { ", a larger slip_velocity" } else { "" };
    let suitable = law.stiffness_to_hold(pair, force);
    let (factor, side) =
        if suitable > stiffness { (suitable / stiffness, "less") } else { (stiffness / suitable, "more") };
    let held = format!(
        "{a} and {b} press with {force:.2e} N, which about {suitable:.1e} Pa would hold at the sum of their radii"
    );
    let advice = "give another Contact.stiffness (None takes it from the scene), a larger Contact.tolerance than";
    format!(
        "contact has stalled: {iterations} Newton iterations moved the time on by {advanced:.1e} s; {held}; its stiffness, \
         {stiffness:.1e} Pa, is {factor:.1e} times {side}; {advice} {}{friction}, or smaller loads",
        law.delta(),
    )
}
