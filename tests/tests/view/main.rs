//! What `atoll view` and `atoll run --view` show: in a real browser, where there is one; that looking changes nothing; and what
//! becomes of those who mean ill.
#![cfg(unix)]

mod hostile;
mod pages;
mod unseen;
