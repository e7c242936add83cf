//! Each run in a process of its own: its memory is its own, and it may crash.

use super::{Engine, Failure, Run};
use std::io::Read;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Runs this program again with these arguments, which make it print a [`Run`] as one line of JSON.
///
/// # Errors
/// One line: what the child said and how it ended. A child that takes longer than `patience` is ended.
pub fn run(engine: Engine, arguments: &[String], patience: Duration) -> Result<Run, Failure> {
    let program = std::env::current_exe().map_err(Failure::broken)?;
    let mut command = Command::new(program);
    command.args(arguments);
    wait(&mut command, patience)
        .map_err(|failure| Failure { message: format!("{engine}: {}", failure.message), ..failure })
}

fn wait(command: &mut Command, patience: Duration) -> Result<Run, Failure> {
    let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(Failure::broken)?;
    let (stdout, stderr) = (listen(child.stdout.take()), listen(child.stderr.take()));
    let status = watch(&mut child, patience)?;
    let hear = |voice: JoinHandle<String>| voice.join().expect("it only reads");
    let (stdout, stderr) = (hear(stdout), hear(stderr));
    if !status.success() {
        let said = last_line(&stderr).or(last_line(&stdout)).unwrap_or("it said nothing");
        // What it refuses it refuses by exit 2 and in words of its own.
        let refused = status.code() == Some(2);
        let message = if refused { said.to_owned() } else { format!("{said} ({status})") };
        return Err(Failure { exit: if refused { 2 } else { 1 }, message });
    }
    last_line(&stdout)
        .and_then(|line| serde_json::from_str(line).ok())
        .ok_or_else(|| Failure::broken(format!("it ended well without figures ({status})")))
}

/// Reads to the end without ever stopping the child.
fn listen(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    thread::spawn(move || {
        let mut heard = Vec::new();
        // What came before an error is still worth telling.
        let _ = pipe.expect("it is piped").read_to_end(&mut heard);
        String::from_utf8_lossy(&heard).into_owned()
    })
}

fn watch(child: &mut Child, patience: Duration) -> Result<ExitStatus, Failure> {
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait().map_err(Failure::broken)? {
            return Ok(status);
        }
        if start.elapsed() > patience {
            // It may have ended just now; then there is nothing to kill.
            let _ = child.kill();
            let status = child.wait().map_err(Failure::broken)?;
            let message = format!("not done after {patience:?} and ended ({status}); raise --timeout");
            return Err(Failure::broken(message));
        }
        thread::sleep(Duration::from_millis(20));
    }
}

fn last_line(text: &str) -> Option<&str> {
    text.lines().map(str::trim).rfind(|line| !line.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str, patience: Duration) -> Failure {
        wait(Command::new("sh").args(["-c", script]), patience).unwrap_err()
    }

    #[test]
    fn a_child_that_crashes_refuses_or_hangs_is_told_in_one_line() {
        let long = Duration::from_secs(60);
        let refused = shell("echo noise; echo too many bodies >&2; exit 2", long);
        assert_eq!(refused, Failure::refused("too many bodies"));
        let broken = shell("echo first >&2; echo last >&2; exit 7", long);
        assert_eq!(broken, Failure::broken("last (exit status: 7)"));
        let crashed = shell("kill -SEGV $$", long);
        assert!(crashed.message.contains("SIGSEGV") && !crashed.message.contains('\n'), "{crashed:?}");
        let hung = shell("exec sleep 1000", Duration::from_millis(100));
        assert!(hung.exit == 1 && hung.message.starts_with("not done after 100ms"), "{hung:?}");
        let empty = shell("true", long);
        assert!(empty.message.starts_with("it ended well without figures"), "{empty:?}");
    }
}
