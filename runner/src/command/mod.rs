//! What is done to a world while it runs, and asked of it, as lines of JSON: `text` reads a line, `script` a file of them,
//! `state` says what those so far add up to, `answer` tells what came of a question.
//!
//! A line has the number of steps that are made when it is its turn, and one thing to do or to ask. All ranks take the lines of a
//! step in one order, so that a run depends on them and on nothing else.

mod answer;
mod rehearsal;
mod script;
mod state;
mod text;

pub(crate) use answer::{Answer, Part};
pub use rehearsal::rehearse;
pub(crate) use script::Script;
pub use script::ScriptError;
pub(crate) use state::{Since, State};
pub(crate) use text::{Action, Event, Line, NO_UNTIL, NewBody, Question, Word, named, word};
