//! The linearized robot fitted to frequency responses (thesis section 3.4.2).

mod direct;
mod hold;
mod modal;
mod response;
mod second_order;

pub use hold::Hold;
pub use response::{Columns, evaluate};
pub use second_order::{Linearizer, SecondOrder, SecondOrderDerivative, SecondOrderError};
