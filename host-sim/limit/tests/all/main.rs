//! Every test in one program: it is linked once.

mod weights;
mod population;
mod frame;
mod limit;
mod reference;
mod identify;
