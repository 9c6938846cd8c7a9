//! A floating base as six joints, for code that takes any tree of joints.

use super::description::{Joint, Motion, RobotDescription};

/// Names of the coordinates of a floating base: shifts along its axes, turns about them.
pub const BASE_NAMES: [&str; 6] = [
    "base.x",
    "base.y",
    "base.z",
    "base.turn_x",
    "base.turn_y",
    "base.turn_z",
];

impl RobotDescription {
    /// Number of coordinates: the joints, and six of a floating base.
    pub fn n_coordinates(&self) -> usize {
        let base = self.floating_base.iter().flat_map(|_| BASE_NAMES);
        base.count() + self.joints.len()
    }

    /// The same robot on six joints without motors in place of its floating base, and without
    /// gravity. A robot with a fixed base stays as it is.
    ///
    /// The joints stand for the motion of the base at one instant, at which all of them are at zero:
    /// three shifts without speed, accelerated by the proper acceleration of the base; then turns
    /// about x, y and z with its angular velocity w as speeds. For the angular acceleration e of the
    /// base, the turns have the accelerations `e - (w_y w_z, -w_x w_z, w_x w_y)`, because the turn
    /// about x carries the axes of the other two, and that about y carries the axis z.
    #[must_use]
    pub fn on_base_joints(&self) -> Self {
        let Some(link) = &self.floating_base else {
            return self.clone();
        };
        let mut joints: Vec<Joint> = BASE_NAMES
            .iter()
            .enumerate()
            .map(|(i, name)| Joint {
                name: (*name).to_owned(),
                parent: i.checked_sub(1),
                motion: if i < 3 {
                    Motion::Prismatic
                } else {
                    Motion::Revolute
                },
                origin: [0.0; 3],
                axis: std::array::from_fn(|k| f64::from(u8::from(k == i % 3))),
                compliance: None,
                link: None,
                drive: None,
            })
            .collect();
        let last = joints.len() - 1;
        joints[last].link = Some(*link);
        let n = joints.len();
        joints.extend(self.joints.iter().cloned().map(|joint| Joint {
            parent: Some(joint.parent.map_or(last, |parent| parent + n)),
            ..joint
        }));
        Self {
            gravity: [0.0; 3],
            joints,
            floating_base: None,
            ..self.clone()
        }
    }
}
