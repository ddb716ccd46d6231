//! States from elsewhere are checked by the core itself; an interrupted step leaves the state as it was.

#[path = "common/scenes.rs"]
mod scenes;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use flagrs::simulation::Simulation;
use flagrs::simulation::failure::StepError;
use flagrs::state::State;
use flagrs::step::scheme::Scheme;

/// Makes a field wrong.
type Spoil = fn(&mut State);

fn robot() -> Simulation {
    let scenes::Canonical { specification, dt } = scenes::read("robot");
    Simulation::new(specification, Scheme::Overdamped, dt, 1).expect("a valid scene")
}

#[test]
fn a_state_with_a_wrong_field_is_refused_by_name_and_the_present_one_kept() {
    let wrongs: [(&str, Spoil); 9] = [
        ("state.time", |state| state.time = f64::NAN),
        ("state.q", |state| state.q.push(0.0)),
        ("state.q", |state| state.q[4] = f64::INFINITY),
        ("state.velocity", |state| state.velocity.truncate(3)),
        ("state.motor_angles", |state| state.motor_angles.clear()),
        ("state.control_step", |state| state.control.dt = -1.0),
        ("state.control_order", |state| state.control.order = 0),
        ("state.history_order", |state| state.history.order = 4),
        ("state.directors", |state| state.frames.directors[0] = state.frames.tangents[0]),
    ];
    let mut simulation = robot();
    for _ in 0..3 {
        simulation.step().expect("an ordinary step");
    }
    let before = simulation.state().clone();
    for (field, spoil) in wrongs {
        let mut state = before.clone();
        spoil(&mut state);
        let refusal = simulation.adopt(state).expect_err(field).to_string();
        assert!(refusal.contains(field), "{field} is not named in: {refusal}");
        assert_eq!(simulation.state(), &before);
    }
    simulation.adopt(before).expect("its own state");
}

#[test]
fn a_run_interrupted_anywhere_goes_on_to_the_last_bit_as_if_it_had_not_been() {
    const STEPS: u64 = 12;
    let mut whole = robot();
    for _ in 0..STEPS {
        whole.step().expect("an ordinary step");
    }
    for last_question in 1..4 {
        let questions = Arc::new(AtomicUsize::new(0));
        let mut broken = robot();
        // The account of energies is opened in the first step.
        broken.step().expect("an ordinary step");
        let asked = Arc::clone(&questions);
        // Every question from this one on is answered with a stop, so that it does not matter how long steps take.
        broken.set_interrupt(Some(Box::new(move || asked.fetch_add(1, Ordering::Relaxed) + 1 >= last_question)));
        let before = loop {
            let before = broken.state().clone();
            match broken.step() {
                Ok(()) => {}
                Err(StepError::Interrupted) => break before,
                Err(other) => panic!("{other}"),
            }
        };
        assert_eq!(questions.load(Ordering::Relaxed), last_question);
        assert_eq!(broken.state(), &before);
        broken.set_interrupt(None);
        if before.steps >= STEPS {
            continue;
        }
        while broken.state().steps < STEPS {
            broken.step().expect("an ordinary step");
        }
        assert_eq!(broken.state(), whole.state());
    }
}
