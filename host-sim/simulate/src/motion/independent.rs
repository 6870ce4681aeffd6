//! Motion of each electrode independently of all others.

use serde::Deserialize;
use taxel_data::{BadValue, Lanes, Purpose, normal_share_below, widest};

use super::{Draws, Motion, Trajectories, check_range};
use crate::sensor::Sensor;

/// Independent motion of every electrode, uniform along each axis; with the default, nothing moves.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Independent {
    /// Range of Δx in mm.
    pub dx_mm: [f64; 2],
    /// Range of Δy in mm.
    pub dy_mm: [f64; 2],
    /// Range of Δz in mm.
    pub dz_mm: [f64; 2],
}

impl Motion for Independent {
    fn range_mm(&self) -> [[f64; 2]; 3] {
        [self.dx_mm, self.dy_mm, self.dz_mm]
    }

    fn check(&self) -> Result<(), BadValue> {
        check_range("dx_mm", self.dx_mm)?;
        check_range("dy_mm", self.dy_mm)?;
        check_range("dz_mm", self.dz_mm)
    }

    fn latents(&self, electrodes: usize) -> usize {
        3 * electrodes
    }

    fn has_independent_rows(&self) -> bool {
        true
    }

    fn place(&self, _: &Sensor, _row: usize, latents: &[Lanes], deformation_mm: &mut [[Lanes; 3]]) {
        let ranges_mm = self.range_mm();
        widest!({
            for (delta, latents) in deformation_mm.iter_mut().zip(latents.chunks_exact(3)) {
                for ((delta, latents), range) in delta.iter_mut().zip(latents).zip(ranges_mm) {
                    for (delta, latent) in delta.iter_mut().zip(latents) {
                        *delta = range[0] + (range[1] - range[0]) * normal_share_below(*latent);
                    }
                }
            }
        });
    }

    fn start<'m>(&'m self, _: &'m Sensor, _: &mut Draws) -> Box<dyn Trajectories + 'm> {
        Box::new(*self)
    }
}

impl Trajectories for Independent {
    fn deform(&mut self, row: usize, draws: &mut Draws, deformation_mm: &mut [[Lanes; 3]]) {
        let ranges_mm = self.range_mm();
        widest!({
            let random = draws.of(Purpose::Deformation, row as u64);
            for delta in &mut *deformation_mm {
                random.between(ranges_mm, delta);
            }
        });
    }
}
