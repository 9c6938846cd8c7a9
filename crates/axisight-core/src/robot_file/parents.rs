//! The joint, or the base, that carries a joint.

use super::document::Section;
use super::error::RobotError;
use crate::robot::Joint;

/// Name of the base in the key `parent`.
const BASE: &str = "base";

/// Index of the joint whose link carries the joint of `section`; `None` is the base.
///
/// `before` are the joints of the file before it. Without the key, the last of them carries it.
pub(super) fn read_parent(
    section: &Section,
    before: &[Joint],
) -> Result<Option<usize>, RobotError> {
    let Some(entry) = section.find("parent") else {
        return Ok(before.len().checked_sub(1));
    };
    let name = entry.string()?;
    let found = before.iter().position(|joint| joint.name == name);
    match (name, found) {
        (BASE, Some(index)) => {
            let got = format!("\"base\", which is also the name of joint[{}]", index + 1);
            Err(entry.invalid("a name of one thing only; rename the joint".to_owned(), got))
        }
        (BASE, None) => Ok(None),
        (_, Some(index)) => Ok(Some(index)),
        (_, None) => {
            let names = before.iter().map(|joint| joint.name.as_str());
            let known: Vec<_> = names.chain([BASE]).collect();
            let expected = "the name of a joint before this one, or \"base\"";
            Err(entry.refuse(format!("{expected}: {}", known.join(", "))))
        }
    }
}
