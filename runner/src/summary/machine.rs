//! What a run was made on, for people who compare times.

use std::env::consts::{ARCH, OS};
use std::fs;
use std::thread;

/// The machine of this process in a few words, such as `AMD EPYC 9B14, 2 cores, x86_64 linux`; what is not known is left out.
pub(crate) fn words() -> String {
    let processor = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| processor(&text).map(str::to_owned));
    let cores = thread::available_parallelism().ok().map(|cores| match cores.get() {
        1 => "1 core".to_owned(),
        cores => format!("{cores} cores"),
    });
    [processor, cores, Some(format!("{ARCH} {OS}"))].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The name of the first processor in Linux's table of them.
fn processor(table: &str) -> Option<&str> {
    let line = table.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim()).filter(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_named_where_it_is_known() {
        let table = "processor\t: 0\nmodel name\t: Some CPU @ 3 GHz\nprocessor\t: 1\nmodel name\t: Other\n";
        assert_eq!(processor(table), Some("Some CPU @ 3 GHz"));
        assert_eq!(processor("processor\t: 0\nmodel name\t: \n"), None);
        assert_eq!(processor("CPU implementer\t: 0x41\n"), None);
        assert!(words().ends_with(&format!("{ARCH} {OS}")));
    }
}
