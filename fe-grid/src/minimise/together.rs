//! One observer for all processes: that of the first.

use super::memory::{Memory, MemoryPair};
use super::observer::{Control, Iteration, Observer};
use crate::distribution::Distribution;
use crate::vector::in_double;

/// Does work of several processes with one observer, that of the first: reports of the first process reach
/// it, and all processes follow its decisions. What it remembers is that of all, with the parts of all
/// processes in its vectors: checkpoints do not depend on the number of processes. A memory that the work
/// resumes from has the own parts of the vectors, and all of what the objective remembers.
///
/// All processes call the functions of the observer together. One process calls its observer itself.
pub fn together<R>(
    distribution: &Distribution,
    observer: &mut dyn Observer,
    work: impl FnOnce(&mut dyn Observer) -> R,
) -> R {
    if distribution.is_alone() {
        return work(observer);
    }
    work(&mut Together {
        observer,
        distribution,
    })
}

struct Together<'a> {
    observer: &'a mut dyn Observer,
    distribution: &'a Distribution,
}

impl Together<'_> {
    /// What the observer of the first process decides.
    fn decide<const N: usize>(
        &mut self,
        ask: impl FnOnce(&mut dyn Observer) -> [f64; N],
    ) -> [f64; N] {
        let mut answer = [0.0; N];
        if self.distribution.is_first() {
            answer = ask(self.observer);
        }
        self.distribution.communicator().broadcast(0, &mut answer);
        answer
    }

    fn control(&mut self, ask: impl FnOnce(&mut dyn Observer) -> Control) -> Control {
        let [cancels] =
            self.decide(|observer| [f64::from(u8::from(ask(observer) == Control::Cancel))]);
        if cancels > 0.0 {
            Control::Cancel
        } else {
            Control::Continue
        }
    }

    /// Numbers of the first process on all.
    fn broadcast(&self, numbers: &[f64]) -> Vec<f64> {
        let communicator = self.distribution.communicator();
        let mut length = [numbers.len() as f64];
        communicator.broadcast(0, &mut length);
        let mut numbers = numbers.to_vec();
        numbers.resize(length[0] as usize, 0.0);
        communicator.broadcast(0, &mut numbers);
        numbers
    }

    /// The part of this process of a vector of unknowns that the first process has.
    fn own(&self, all: &[f64]) -> Vec<f64> {
        let all = self.broadcast(all);
        let own = self.distribution.own();
        let dim = all.len() / self.distribution.n_parts().max(1);
        all.get(own.start * dim..own.end * dim)
            .unwrap_or_default()
            .to_vec()
    }
}

impl Observer for Together<'_> {
    fn level(&mut self, level: usize, n_levels: usize, dim: usize) {
        let mut dims = [dim as f64];
        self.distribution.communicator().sum(&mut dims);
        if self.distribution.is_first() {
            self.observer.level(level, n_levels, dims[0] as usize);
        }
    }

    fn iteration(&mut self, iteration: &Iteration<'_>) -> Control {
        self.control(|observer| observer.iteration(iteration))
    }

    fn resume(&mut self) -> Option<Memory<'static>> {
        let mut found = None;
        let [exists, n_pairs] = self.decide(|observer| {
            found = observer.resume();
            let pairs = found.as_ref().map_or(0, |memory| memory.pairs.len());
            [f64::from(u8::from(found.is_some())), pairs as f64]
        });
        if exists == 0.0 {
            return None;
        }
        let known = found.unwrap_or_else(|| Memory::of_result(&[], Vec::new()));
        let mut numbers = known.to_numbers();
        self.distribution.communicator().broadcast(0, &mut numbers);
        let mut memory = Memory::of_result(&[], self.broadcast(&known.objective));
        memory.energies = self.broadcast(&known.energies).into();
        memory.set_numbers(&numbers);
        memory.x = self.own(&known.x).into();
        memory.gradient = self.own(&known.gradient).into();
        for i in 0..n_pairs as usize {
            let vector = |of: fn(&MemoryPair<'_>) -> Vec<f64>| {
                let all = known.pairs.get(i).map_or_else(Vec::new, of);
                self.own(&all)
                    .into_iter()
                    .map(|x| x as f32)
                    .collect::<Vec<f32>>()
            };
            let step = vector(|pair| in_double(&pair.step.numbers()).into_owned());
            let change = vector(|pair| in_double(&pair.change.numbers()).into_owned());
            let scales = known
                .pairs
                .get(i)
                .map_or([0.0; 2], |pair| [pair.inverse_curvature, pair.ratio]);
            let scales = self.broadcast(&scales);
            memory.pairs.push(MemoryPair {
                step: step.into(),
                change: change.into(),
                inverse_curvature: scales[0],
                ratio: scales[1],
            });
        }
        Some(memory)
    }

    fn remembers(&mut self, ended: bool) -> bool {
        let [remembers] = self.decide(|observer| [f64::from(u8::from(observer.remembers(ended)))]);
        remembers > 0.0
    }

    fn memory(&mut self, memory: &Memory<'_>) {
        if !self.remembers(memory.ended.is_some()) {
            return;
        }
        let gather = |own: &[f64]| self.distribution.gather(own).unwrap_or_default();
        let single = |own: &[f32]| {
            gather(&in_double(own))
                .into_iter()
                .map(|x| x as f32)
                .collect::<Vec<f32>>()
        };
        let pair = |pair: &MemoryPair<'_>| MemoryPair {
            step: single(&pair.step.numbers()).into(),
            change: single(&pair.change.numbers()).into(),
            ..*pair
        };
        let all = Memory {
            x: gather(&memory.x).into(),
            gradient: gather(&memory.gradient).into(),
            pairs: memory.pairs.iter().map(pair).collect(),
            ..memory.clone()
        };
        if self.distribution.is_first() {
            self.observer.memory(&all);
        }
    }

    fn between(&mut self) -> Control {
        self.control(|observer| observer.between())
    }
}
