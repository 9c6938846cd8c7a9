//! Parameters of the regressor, from a robot description.

use axisight_plant::robot::{Link, RobotDescription};

/// Mass, first moments and inertia about the link frame of every link with mass, in chain order;
/// a floating base comes first.
///
/// Each link has ten parameters: m, mx, my, mz, xx, yy, zz, xy, xz, yz [kg, kg m, kg m^2].
pub fn link_parameters(robot: &RobotDescription) -> Vec<f64> {
    let links = robot.joints.iter().filter_map(|joint| joint.link.as_ref());
    let base = robot.floating_base.iter();
    base.chain(links).flat_map(about_frame).collect()
}

/// Moments of one link about the origin of its frame (parallel axes).
fn about_frame(link: &Link) -> [f64; 10] {
    let (m, [x, y, z]) = (link.mass, link.com);
    let [xx, yy, zz, xy, xz, yz] = link.inertia;
    [
        m,
        m * x,
        m * y,
        m * z,
        xx + m * (y * y + z * z),
        yy + m * (x * x + z * z),
        zz + m * (x * x + y * y),
        xy - m * x * y,
        xz - m * x * z,
        yz - m * y * z,
    ]
}
