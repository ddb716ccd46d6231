//! States from elsewhere are checked by the core itself; an interrupted step leaves the state as it was.

#[path = "common/scenes.rs"]
mod scenes;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use flagrs::inputs::Inputs;
use flagrs::signal::Signal;
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

#[test]
fn simulations_of_a_shared_model_make_the_same_steps_and_know_nothing_of_each_other() {
    let mut alone = robot();
    let (model, start) = (alone.shared_model(), alone.state().clone());
    let mut shared: Vec<Simulation> = (0..2)
        .map(|_| {
            let inputs = Inputs::of(&model);
            Simulation::from_model(Arc::clone(&model), inputs, start.clone(), Scheme::Overdamped, alone.dt(), 1)
                .expect("the model is valid")
        })
        .collect();
    for _ in 0..3 {
        alone.step().expect("an ordinary step");
        shared.iter_mut().for_each(|simulation| simulation.step().expect("an ordinary step"));
    }
    assert!(shared.iter().all(|simulation| simulation.state() == alone.state()));
    // Other inputs move one of them only.
    let inputs = shared[0].inputs();
    let still = vec![Signal::Constant(0.0); inputs.motors().len()];
    let (clamps, loads, flows) = (inputs.clamps().to_vec(), inputs.loads().to_vec(), inputs.flows().to_vec());
    let other = Inputs::with(&model, still, clamps.clone(), loads.clone(), flows.clone()).expect("as many of each");
    shared[0].set_inputs(other);
    shared.iter_mut().for_each(|simulation| simulation.step().expect("an ordinary step"));
    alone.step().expect("an ordinary step");
    assert_eq!(shared[1].state(), alone.state());
    // Three steps of turning, and one of standing still.
    let quarter = |angle: &f64| 0.75 * angle;
    let expected: Vec<f64> = alone.state().motor_angles.iter().map(quarter).collect();
    let stopped = &shared[0].state().motor_angles;
    assert!(expected.iter().zip(stopped).all(|(a, b)| *b != 0.0 && (a / b - 1.0).abs() < 1e-12), "{stopped:?}");
    let refusal = Inputs::with(&model, vec![], clamps, loads, flows).err().expect("too few motors").to_string();
    assert!(refusal.contains("motors: length 0"), "{refusal}");
}
