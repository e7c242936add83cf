//! Hostile input: a million frames, fifty thousand saved tiles, forty thousand files of scenes, twenty thousand segments of
//! recordings, as many files of commands, ten thousand configurations and a few thousand command lines that nobody would write, against the targets of
//! [`atoll_tests::fuzz`]. No panic, no error of two lines, and no more memory than the bytes that came can justify.
//!
//! Input that is refused at the door tests nothing behind it. So what is aimed at one field must be refused for what that
//! field is checked for, and every kind of refusal must have come about in the end, as a [`tally::Tally`] counts.

mod collective;
mod command_lines;
mod commands;
mod configurations;
mod frames;
mod memory;
mod pages;
mod random;
mod saved_tiles;
mod scenes;
mod segments;
mod tally;
mod values;
