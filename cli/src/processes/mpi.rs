//! Processes that exchange messages over MPI.

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use ::mpi::Threading;
use ::mpi::collective::SystemOperation;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{
    Communicator as _, CommunicatorCollectives, Destination, MatchedReceiveVec, Root, Source,
};
use fe_grid::communicator::Communicator;

use super::{Launched, PROCESSES, done, refused};
use crate::error::{CliError, Exit};

/// Most numbers of one message: MPI counts them by 32 bits.
const MESSAGE: usize = 1 << 26;
/// Numbers that are reduced at a time: they stay in the caches of processes on one machine.
const REDUCED: usize = 1 << 15;
/// The tag of messages outside of collective functions.
const LETTER: i32 = 1;
/// An error of the inputs is found by all processes: the others leave its report to the first, for this
/// time.
const PATIENCE: Duration = Duration::from_secs(3);

/// Runs work on all processes of MPI. An error or a panic on one of them ends all.
pub(super) fn run(launched: Launched, work: impl FnOnce() -> Result<Exit, CliError>) -> ExitCode {
    // Commands run on a thread of the pool, the only one that sends messages.
    let started = ::mpi::initialize_with_threading(Threading::Serialized);
    let Some((universe, threading)) = started else {
        return done(Err(failed("MPI does not start")));
    };
    let world = universe.world();
    if threading < Threading::Serialized {
        return done(Err(failed(
            "MPI does not allow for messages from several threads",
        )));
    }
    if world.size() == 1 {
        return refused(
            launched,
            &failed("MPI does not know of the other processes"),
        );
    }
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        usual(panic);
        SimpleCommunicator::world().abort(101);
    }));
    // Nobody has set it before.
    let _ = PROCESSES.set(Arc::new(World));
    let error = match work() {
        Ok(exit) if world.rank() == 0 => return exit.into(),
        Ok(_) => return Exit::Success.into(),
        Err(error) => error,
    };
    if world.rank() > 0 {
        std::thread::sleep(PATIENCE);
    }
    error.report();
    world.abort(i32::from(error.exit() as u8))
}

fn failed(message: &str) -> CliError {
    CliError::Computation {
        message: message.into(),
        remedy: "start it with the mpirun of the MPI that it was built with, or on one process"
            .into(),
    }
}

/// All processes. The handle of MPI is not kept, as it cannot be sent to another thread.
#[derive(Debug)]
struct World;

impl World {
    fn reduce(values: &mut [f64], operation: SystemOperation) {
        let mut own = Vec::with_capacity(REDUCED.min(values.len()));
        for part in values.chunks_mut(REDUCED) {
            own.clear();
            own.extend_from_slice(part);
            SimpleCommunicator::world().all_reduce_into(&own[..], part, operation);
        }
    }
}

impl Communicator for World {
    fn rank(&self) -> usize {
        SimpleCommunicator::world().rank() as usize
    }

    fn size(&self) -> usize {
        SimpleCommunicator::world().size() as usize
    }

    fn sum(&self, values: &mut [f64]) {
        Self::reduce(values, SystemOperation::sum());
    }

    fn maximum(&self, values: &mut [f64]) {
        Self::reduce(values, SystemOperation::max());
    }

    fn broadcast(&self, root: usize, values: &mut [f64]) {
        let world = SimpleCommunicator::world();
        let root = world.process_at_rank(root as i32);
        for part in values.chunks_mut(MESSAGE) {
            root.broadcast_into(part);
        }
    }

    fn gather(&self, values: &[f64]) -> Option<Vec<f64>> {
        let world = SimpleCommunicator::world();
        if self.rank() > 0 {
            let first = world.process_at_rank(0);
            first.send(&[values.len() as f64][..]);
            for part in values.chunks(MESSAGE) {
                first.send(part);
            }
            return None;
        }
        let mut all = values.to_vec();
        for rank in 1..world.size() {
            let process = world.process_at_rank(rank);
            let mut length = [0.0];
            process.receive_into(&mut length[..]);
            let start = all.len();
            all.resize(start + length[0] as usize, 0.0);
            for part in all[start..].chunks_mut(MESSAGE) {
                process.receive_into(part);
            }
        }
        Some(all)
    }

    fn send(&self, to: usize, message: &[u8]) {
        let world = SimpleCommunicator::world();
        world
            .process_at_rank(to as i32)
            .send_with_tag(message, LETTER);
    }

    fn receive(&self) -> Option<(usize, Vec<u8>)> {
        let world = SimpleCommunicator::world();
        let arrived = world
            .any_process()
            .immediate_matched_probe_with_tag(LETTER)?;
        let (bytes, status) = arrived.matched_receive_vec();
        Some((status.source_rank() as usize, bytes))
    }
}
