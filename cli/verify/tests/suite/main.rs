//! The tests of the parts that the experiments share, as one program of its own: the errors that the other one
//! switches on hold for its whole process. Here and not beside what they test, since the library with its
//! experiments would be compiled once more for unit tests.

mod order;
mod plot;
mod record;
mod select;
mod statements;
mod tools;
mod verdict;
