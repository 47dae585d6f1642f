//! Cost maps: the criterion over two parameters around the optimum.

mod map;
mod model;
mod motor;

pub use map::{CostMap, MapParameter};
pub use model::model_cost_map;
pub use motor::cost_map;
