//! The part of the module `taxel` that is compiled: commands, models, decoders, scenes and devices, for `python/taxel`.

// From the ground up: a module imports only what is declared before it.
mod call;
mod model;
mod scene;
mod link;
mod recording;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // glibc returns large blocks to the system one by one, until it has seen such a block freed: arrays of estimates would
    // spend as long on new pages as on decoding.
    drop(std::hint::black_box(Vec::<u8>::with_capacity(31 << 20)));
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(call::call, module)?)?;
    module.add_function(wrap_pyfunction!(call::main, module)?)?;
    module.add_function(wrap_pyfunction!(link::ports, module)?)?;
    module.add_function(wrap_pyfunction!(link::only_usb_port, module)?)?;
    module.add_function(wrap_pyfunction!(recording::read_recording, module)?)?;
    module.add_class::<model::Blob>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<link::Line>()
}
