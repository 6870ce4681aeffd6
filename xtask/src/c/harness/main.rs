//! Decodes the frames of files with models exported to Rust, and compares all bits with what taxel-core made of them. The
//! files are what `xtask/src/c/frames.rs` writes; `main.c` reads them for C. The modules of the models stand before.

use taxel_core::Decoded;
use taxel_core::health::{Health, Limits};
use taxel_core::relative::reciprocal;

/// What is left of a file.
struct File(Vec<u8>, usize);

impl File {
    fn take(&mut self, bytes: usize) -> &[u8] {
        self.1 += bytes;
        &self.0[self.1 - bytes..self.1]
    }

    fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.take(4).try_into().unwrap())
    }

    fn floats<const N: usize, const M: usize>(&mut self) -> [[f32; N]; M] {
        [(); M].map(|()| [(); N].map(|()| f32::from_bits(self.word())))
    }

    /// Whether these are the floats that come next.
    fn same(&mut self, found: &[f32]) -> bool {
        let bytes: Vec<u8> = found.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.take(bytes.len()) == bytes
    }
}

type Rows<const COUNT: usize, const ROWS: usize> = [[f32; COUNT]; ROWS];

/// Functions of a model; those that it has not do nothing.
struct Model<const R: usize, const I: usize, const O: usize> {
    decode: fn(&Rows<I, R>, &Rows<I, R>) -> Decoded<R, O>,
    assess: Option<fn(&Rows<I, R>, &Rows<I, R>, &mut Rows<O, R>) -> f32>,
    fill: Option<fn(&mut Rows<I, R>, &Rows<I, R>) -> usize>,
}

fn compare<const R: usize, const I: usize, const O: usize>(
    name: &str,
    model: &Model<R, I, O>,
) -> bool {
    let folder = std::env::args().nth(1).unwrap();
    let mut file = File(std::fs::read(format!("{folder}/{name}/frames.bin")).unwrap(), 0);
    let mut number = 0_u32;
    loop {
        let count = file.word();
        if count == 0 {
            return number == file.word();
        }
        let mut baseline: Rows<I, R> = file.floats();
        Health::new(baseline.as_flattened_mut(), I, Limits::USUAL, &mut []);
        let reciprocals = baseline.map(|row| row.map(reciprocal));
        for _ in 0..count {
            let mut readings: Rows<I, R> = file.floats();
            Health::new(readings.as_flattened_mut(), I, Limits::USUAL, &mut []);
            let Decoded { outputs, status, clamped } = (model.decode)(&readings, &reciprocals);
            let mut same = file.word() == u32::from(clamped) && file.same(outputs.as_flattened());
            same &= file.take(R) == status.map(|status| status as u8);
            if let Some(assess) = model.assess {
                let mut deviations = [[0.0; O]; R];
                let novelty = assess(&readings, &reciprocals, &mut deviations);
                same &= file.same(&[novelty]) & file.same(deviations.as_flattened());
            }
            if let Some(fill) = model.fill {
                same &= fill(&mut readings, &reciprocals) as u32 == file.word();
                // Which of all NaN comes out is the processor's choice.
                let usual = |value: f32| if value.is_nan() { f32::NAN } else { value };
                same &= file.same(readings.map(|row| row.map(usual)).as_flattened());
            }
            if !same {
                println!("{name}: frame {number} differs");
                return false;
            }
            number += 1;
        }
    }
}
