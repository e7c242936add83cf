//! Options of the verbs that look at what runs have written.

use super::svg;
use clap::Args;
use std::path::PathBuf;

/// Options of `atoll diff`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DiffArgs {
    /// The folder of a run.
    pub a: PathBuf,
    /// The folder of the run to compare it with.
    pub b: PathBuf,
    /// Deviations up to this count as none, in m, rad, m/s and rad/s [default: every bit counts].
    #[arg(long, value_name = "T", value_parser = tolerance)]
    pub tolerance: Option<f64>,
    /// Write the differences to this file, as JSON.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a picture of how the deviations grow to this file, as SVG.
    #[arg(long, value_name = "FILE", value_parser = svg())]
    pub plot: Option<PathBuf>,
}

/// Options of `atoll info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The folder of a run, or a file in it.
    pub path: PathBuf,
}

/// Options of `atoll report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The folder of a run, or of two runs to compare.
    #[arg(required = true, num_args = 1..=2, value_name = "DIR")]
    pub runs: Vec<PathBuf>,
    /// Write the page to this file, as HTML.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Options of `atoll export`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ExportArgs {
    /// The folder of a run.
    pub run: PathBuf,
    /// Write files for ParaView to this folder, which must be new or empty; run.pvd is the one to open.
    #[arg(long, value_name = "OUT")]
    pub vtk: PathBuf,
    /// Write what there is every so many steps [default: each that was recorded].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u64).range(1..))]
    pub every: Option<u64>,
}

fn tolerance(text: &str) -> Result<f64, &'static str> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0);
    number.ok_or("must be a finite number, at least 0")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn parse<T: Args>(line: &str) -> Result<T, String> {
        let command = T::augment_args(clap::Command::new("atoll"));
        let matches = command.try_get_matches_from(["atoll"].into_iter().chain(line.split_whitespace()));
        let args = matches.and_then(|matches| T::from_arg_matches(&matches));
        args.map_err(|error| error.to_string())
    }

    #[test]
    fn runs_are_compared_within_a_tolerance() {
        let args = parse::<DiffArgs>("runs/a runs/b --tolerance 1e-3 --json d.json").unwrap();
        assert_eq!((args.a.as_path(), args.b.as_path()), (Path::new("runs/a"), Path::new("runs/b")));
        assert_eq!((args.tolerance, args.json.is_some(), args.plot.is_some()), (Some(0.001), true, false));
        assert_eq!(parse::<DiffArgs>("a b").unwrap().tolerance, None);
        let error = parse::<DiffArgs>("a b --plot d.png").unwrap_err();
        assert!(error.contains("'--plot <FILE>': is drawn as SVG; end its name in .svg"), "{error}");
        assert!(parse::<DiffArgs>("a b --plot d.SVG").is_ok() && parse::<DiffArgs>("a b --plot /dev/stdout").is_ok());
        for value in ["-1", "nan", "inf", "1e999", "much"] {
            let error = parse::<DiffArgs>(&format!("a b --tolerance {value}")).unwrap_err();
            assert!(error.contains("'--tolerance <T>': must be a finite number, at least 0"), "{error}");
        }
        assert!(parse::<DiffArgs>("a").unwrap_err().contains("<B>"));
        let args = parse::<ReportArgs>("runs/a runs/b --out r.html").unwrap();
        assert_eq!((args.runs.len(), args.out.as_path()), (2, Path::new("r.html")));
        for line in ["--out r.html", "a", "a b c --out r.html"] {
            assert!(parse::<ReportArgs>(line).is_err(), "{line}");
        }
        let args = parse::<ExportArgs>("runs/a --vtk out --every 5").unwrap();
        assert_eq!((args.vtk.as_path(), args.every), (Path::new("out"), Some(5)));
        assert_eq!(parse::<ExportArgs>("runs/a --vtk out").unwrap().every, None);
        for value in ["0", "-1", "1.5", "all"] {
            let error = parse::<ExportArgs>(&format!("a --vtk b --every {value}")).unwrap_err();
            assert!(error.contains("for '--every <K>'"), "{error}");
        }
        assert!(parse::<ExportArgs>("a").unwrap_err().contains("--vtk <OUT>"));
        assert_eq!(parse::<InfoArgs>("runs/a").unwrap().path, Path::new("runs/a"));
    }
}
