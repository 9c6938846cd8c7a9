//! Robots with branches: they equal their chains, whatever the order of the branches.

use axisight_core::plant::{Plant, assemble, equilibrium};
use axisight_core::robot::{
    Chain, Dynamics, EffectSetting, Joint, Link, Motion, Place, RigidBody, RobotDescription,
};
use axisight_fit::regressor::{Motion as Along, Regressor, link_parameters};
use axisight_scalar::{Dual, Lanes, Scalar};
use axisight_tests::{PRESET, Random, relative, robot};

/// A joint with random axis, origin and link.
fn joint(name: &str, parent: Option<usize>, random: &mut Random) -> Joint {
    let mut next = || random.within(1.0);
    let direction = [next(), next(), next() + 2.0];
    let norm = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    let slides = next() > 0.5;
    Joint {
        name: name.to_owned(),
        parent,
        motion: if slides {
            Motion::Prismatic
        } else {
            Motion::Revolute
        },
        origin: [next(), next(), next()],
        axis: direction.map(|x| x / norm),
        compliance: None,
        link: Some(Link {
            mass: 2.0 + next(),
            com: [next(), next(), next()],
            inertia: [2.0, 3.0, 4.0, 0.3 * next(), 0.3 * next(), 0.3 * next()],
        }),
        drive: robot(PRESET).joints[0].drive,
    }
}

/// A robot with the joints of the given parents.
fn grown(parents: &[Option<usize>], random: &mut Random) -> RobotDescription {
    let joints = parents.iter().enumerate();
    let joints = joints.map(|(i, parent)| joint(&format!("j{i}"), *parent, random));
    RobotDescription {
        joints: joints.collect(),
        operating_point: vec![0.0; parents.len()],
        controller: axisight_core::robot::Controller::None,
        ..robot(PRESET)
    }
}

/// The joints `chosen` of a robot, which must be a chain.
fn part(whole: &RobotDescription, chosen: &[usize]) -> RobotDescription {
    let joints = chosen.iter().enumerate().map(|(i, j)| Joint {
        parent: i.checked_sub(1),
        ..whole.joints[*j].clone()
    });
    RobotDescription {
        joints: joints.collect(),
        operating_point: vec![0.0; chosen.len()],
        ..whole.clone()
    }
}

fn state(n: usize, random: &mut Random) -> [Vec<f64>; 3] {
    std::array::from_fn(|_| (0..n).map(|_| random.within(1.0)).collect())
}

/// Two arms on the base, the joints of one between those of the other.
const ARMS: [Option<usize>; 7] = [None, None, Some(0), Some(1), Some(1), Some(2), Some(4)];
const FIRST: [usize; 3] = [0, 2, 5];
/// A trunk with three branches, one of which branches again.
const TREE: [Option<usize>; 9] = [
    None,
    Some(0),
    Some(1),
    Some(0),
    Some(3),
    Some(3),
    Some(5),
    Some(1),
    Some(7),
];

#[test]
fn a_branch_on_the_base_equals_its_own_chain() {
    let mut random = Random(1);
    let whole = grown(&ARMS, &mut random);
    let alone = part(&whole, &FIRST);
    let (tree, chain) = (RigidBody::new(&whole), RigidBody::new(&alone));
    for _ in 0..20 {
        let [q, v, a] = state(whole.joints.len(), &mut random);
        let own = |x: &[f64]| FIRST.map(|i| x[i]).to_vec();
        let forces = tree.inverse_dynamics(&q, &v, &a).expect("forces");
        let of_chain = chain.inverse_dynamics(&own(&q), &own(&v), &own(&a));
        // The same sums in the same order, so every bit agrees; zeros of the other arm add nothing.
        assert_eq!(own(&forces), of_chain.expect("forces"));
        let inertia = tree.inertia_matrix(&q).expect("M");
        let block = chain.inertia_matrix(&own(&q)).expect("M");
        for (i, row) in FIRST.iter().enumerate() {
            for (j, column) in FIRST.iter().enumerate() {
                assert_eq!(inertia[row * 7 + column], block[i * 3 + j]);
            }
            assert_eq!(inertia[row * 7 + 1], 0.0, "arms do not feel each other");
        }
    }
}

#[test]
fn a_chain_gives_the_same_bits_by_the_code_for_trees() {
    let mut random = Random(2);
    for n in 1..=9 {
        let mut parents: Vec<_> = (0..n).map(|i: usize| i.checked_sub(1)).collect();
        // One more joint on the base makes it a tree.
        parents.push(None);
        let whole = grown(&parents, &mut random);
        let alone = part(&whole, &(0..n).collect::<Vec<_>>());
        let (tree, chain) = (RigidBody::new(&whole), RigidBody::new(&alone));
        let [q, v, a] = state(n + 1, &mut random);
        let forces = tree.inverse_dynamics(&q, &v, &a).expect("forces");
        let of_chain = chain.inverse_dynamics(&q[..n], &v[..n], &a[..n]);
        assert_eq!(forces[..n], of_chain.expect("forces"), "{n} joints");
    }
}

#[test]
fn the_order_of_branches_does_not_matter() {
    let mut random = Random(3);
    let whole = grown(&TREE, &mut random);
    // Place of each joint of the new order in the old one, parents first.
    let order = [0, 3, 5, 6, 4, 1, 7, 8, 2];
    let place = |old: usize| order.iter().position(|o| *o == old);
    let joints = order.iter().map(|old| Joint {
        parent: whole.joints[*old].parent.and_then(place),
        ..whole.joints[*old].clone()
    });
    let other = RobotDescription {
        joints: joints.collect(),
        ..whole.clone()
    };
    let (tree, turned) = (RigidBody::new(&whole), RigidBody::new(&other));
    let [q, v, a] = state(9, &mut random);
    let own = |x: &[f64]| order.map(|old| x[old]).to_vec();
    let check = |name: &str, one: Vec<f64>, two: Vec<f64>| {
        // Sums of a few hundred products of order one, rounded at 1.1e-16; the inverse of the
        // inertia matrix multiplies this by its condition, below 1e4.
        assert!(relative(&own(&one), &two) < 1e-10, "{name}");
    };
    let (x, y) = (own(&q), own(&v));
    check(
        "forces",
        tree.inverse_dynamics(&q, &v, &a).expect("forces"),
        turned.inverse_dynamics(&x, &y, &own(&a)).expect("forces"),
    );
    let tau: Vec<f64> = a.iter().map(|a| 100.0 * a).collect();
    check(
        "accelerations",
        tree.forward_dynamics(&q, &v, &tau).expect("accelerations"),
        turned
            .forward_dynamics(&x, &y, &own(&tau))
            .expect("accelerations"),
    );
    let back = tree.forward_dynamics(&q, &v, &tree.inverse_dynamics(&q, &v, &a).expect("forces"));
    assert!(relative(&back.expect("accelerations"), &a) < 1e-10);
    assert_eq!(tree.energy(&q, &v).expect("energy").0.to_bits() >> 63, 0);
}

#[test]
fn jacobians_are_the_slopes_of_poses_and_zero_for_other_branches() {
    let mut random = Random(4);
    let tree = RigidBody::new(&grown(&TREE, &mut random));
    let [q, ..] = state(9, &mut random);
    for link in 0..9 {
        let jacobian = tree.jacobian(&q, link, [0.0; 3]).expect("jacobian");
        for j in 0..9 {
            let origin = |by: f64| {
                let mut at = q.clone();
                at[j] += by;
                tree.pose(&at, link).expect("pose").1
            };
            // Central differences with this step are exact to about 1e-9 for lengths near 1 m.
            let (low, high) = (origin(-1e-5), origin(1e-5));
            for k in 0..3 {
                let slope = (high[k] - low[k]) / 2e-5;
                assert!(
                    (jacobian[(k, j)] - slope).abs() < 1e-8,
                    "link {link}, joint {j}"
                );
            }
        }
    }
}

#[test]
fn lanes_and_derivatives_see_the_branches() {
    let mut random = Random(5);
    let whole = grown(&TREE, &mut random);
    let [q, v, _] = state(9, &mut random);
    let plain = Dynamics::new(&Chain::<f64>::new(&whole));
    let at = plain.evaluate(&q, &v);
    let lanes = |x: &[f64]| {
        x.iter()
            .map(|x| Lanes::<4>::constant(*x))
            .collect::<Vec<_>>()
    };
    let in_lanes = Dynamics::new(&Chain::<Lanes<4>>::new(&whole)).evaluate(&lanes(&q), &lanes(&v));
    let first: Vec<f64> = in_lanes.inertia.iter().map(|x| x.lane(3)).collect();
    // Lanes have their own sine and cosine, right to a few units in the last place.
    assert!(relative(&first, &at.inertia) < 1e-13);
    // The derivative along the second joint, against a central difference.
    let seeded = |x: &[f64], by: usize| {
        let number = |(i, x): (usize, &f64)| match Dual::<f64, 4>::constant(*x) {
            x if i == by => x.seeded(0),
            x => x,
        };
        x.iter().enumerate().map(number).collect::<Vec<_>>()
    };
    let dual = Dynamics::new(&Chain::<Dual<f64, 4>>::new(&whole));
    let slope = dual.evaluate(&seeded(&q, 1), &seeded(&v, usize::MAX)).bias;
    let moved = |by: f64| {
        let mut q = q.clone();
        q[1] += by;
        plain.evaluate(&q, &v).bias
    };
    let (low, high) = (moved(-1e-6), moved(1e-6));
    for i in 0..9 {
        let difference = (high[i] - low[i]) / 2e-6;
        // Forces of about 100 rounded at 1e-16, over 2e-6: about 1e-8 of them.
        assert!(
            (slope[i].partials[0] - difference).abs() < 1e-5,
            "joint {i}"
        );
    }
}

#[test]
fn regressors_times_parameters_are_forces_and_energies() {
    let mut random = Random(6);
    for parents in [&ARMS[..], &TREE[..]] {
        let whole = grown(parents, &mut random);
        let (n, body) = (parents.len(), RigidBody::new(&whole));
        let identity: Vec<f64> = (0..n * n)
            .map(|k| f64::from(u8::from(k / n == k % n)))
            .collect();
        let regressor = Regressor::new(&whole, &identity, Vec::new()).expect("regressor");
        let [q, v, a] = state(n, &mut random);
        let parameters = link_parameters(&whole);
        let times = |rows: &[f64]| {
            let rows = rows.chunks_exact(parameters.len());
            rows.map(|row| row.iter().zip(&parameters).map(|(x, y)| x * y).sum())
                .collect::<Vec<f64>>()
        };
        let along = Along {
            q: &q,
            v: &v,
            a: &a,
        };
        let forces = times(&regressor.evaluate(&along).expect("regressor"));
        let wanted = body.inverse_dynamics(&q, &v, &a).expect("forces");
        // Sums of 90 products of order ten on both sides.
        assert!(relative(&forces, &wanted) < 1e-12, "{forces:?} {wanted:?}");
        let energy = times(&regressor.energy(&q, &v).expect("energy"));
        let (kinetic, potential) = body.energy(&q, &v).expect("energy");
        assert!((energy[0] - kinetic - potential).abs() < 1e-10);
    }
}

#[test]
fn springs_below_carry_every_branch() {
    let mut random = Random(7);
    let whole = grown(&ARMS, &mut random);
    let stiff = EffectSetting {
        name: "base_compliance".to_owned(),
        place: Place::Arm,
        parameters: axisight_core::effects::info("base_compliance")
            .expect("effect")
            .parameters
            .iter()
            .map(|p| p.typical)
            .collect(),
    };
    let plant: Plant<f64> = assemble(&whole, &[], &[stiff]).expect("plant");
    let base = plant.chain.len() - 7;
    assert!(base > 0);
    for (i, joint) in plant.chain.joints.iter().enumerate() {
        let wanted = match i.checked_sub(base) {
            None => i.checked_sub(1),
            Some(own) => Some(ARMS[own].map_or(base - 1, |parent| parent + base)),
        };
        assert_eq!(joint.parent, wanted, "joint {i}");
    }
    assert!(equilibrium(&plant, &[0.1; 7]).is_ok());
}

#[test]
fn effects_at_the_one_tip_refuse_branches() {
    let mut random = Random(8);
    let whole = grown(&ARMS, &mut random);
    for name in ["payload", "link_geometry"] {
        let info = axisight_core::effects::info(name).expect("effect");
        let place = if name == "payload" {
            Place::Arm
        } else {
            Place::Axis(0)
        };
        let setting = EffectSetting {
            name: name.to_owned(),
            place,
            parameters: info.parameters.iter().map(|p| p.typical).collect(),
        };
        let error = assemble::<f64>(&whole, &[], &[setting]).err();
        let error = error.expect("branches");
        let text = error.to_string();
        assert!(
            text.contains(name) && text.contains("without branches"),
            "{text}"
        );
    }
}
