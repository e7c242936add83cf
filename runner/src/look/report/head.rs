//! What was run, and on what; how it ended; its configuration.

use super::html::{Short, Text, Unit, Whole, table, whole};
use super::letter;
use super::source::Source;
use crate::config;
use crate::plan::tiles;
use crate::wording::{form_for, plural};
use std::fmt::Write as _;

/// What the page is called.
pub(super) fn title(sources: &[Source]) -> String {
    let scene = |source: &Source| {
        format!("{}, {}", source.config.scene.kind.title(), whole(source.config.scene.bodies, "body"))
    };
    match sources {
        [a, b] if scene(a) == scene(b) => format!("Two runs of {}", scene(a)),
        [a, b] => format!("{} and {}", scene(a), scene(b)),
        _ => scene(&sources[0]),
    }
}

/// The head of the page: a line for each run, the figures that count most, and what there is to know about the runs.
pub(super) fn of(sources: &[Source]) -> String {
    let mut text = format!("<header><h1>{}</h1>", Text(&title(sources)));
    if let [one] = sources {
        write!(text, "<p>{}, in <code>{}</code></p>", Text(&ended(one)), Text(&one.name))
            .expect("a string takes any text");
    } else {
        text.push_str("<div class=\"runs\">");
        for (run, one) in sources.iter().enumerate() {
            let dash = if run > 0 { " dash" } else { "" };
            let (letter, name) = (letter(run), Text(&one.name));
            write!(
                text,
                "<p><i class=\"key{dash}\"></i><b>{letter}</b> <code>{name}</code>, {}</p>",
                Text(&ended(one))
            )
            .expect("a string takes any text");
        }
        text.push_str("</div>");
    }
    text.push_str("</header>\n");
    for source in sources {
        text.push_str(&missing(source));
    }
    if let [one] = sources {
        text.push_str(&key_figures(one));
    }
    text + "<h2>What was run, and on what</h2>\n" + &facts(sources)
}

/// How it ended, in a few words.
fn ended(source: &Source) -> String {
    let all = source.config.run.steps;
    let made = source.steps();
    let number = made.map_or("an unknown number".to_owned(), |steps| Whole(steps).to_string());
    match &source.summary {
        None => format!("under way or killed: {number} of {} are known", whole(all, "step")),
        Some(summary) if summary["interrupted"] == true => {
            format!("interrupted after {number} of {}", whole(all, "step"))
        }
        Some(_) => format!("complete: {number} {}", form_for(made.unwrap_or_default(), "step")),
    }
}

/// What is not there, and how to get it.
fn missing(source: &Source) -> String {
    let name = Text(&source.name);
    let mut text = String::new();
    let mut say = |what: &str| {
        writeln!(text, "<p class=\"note\"><code>{name}</code>: {what}</p>").expect("a string takes any text");
    };
    match (&source.summary, &source.damaged) {
        (None, None) => {
            say("the run is under way or was killed, so there is no <code>summary.json</code> and no closing \
                            figures; <code>atoll run --resume</code> brings it to its end.")
        }
        (None, Some(_)) => say("<code>summary.json</code> cannot be read, so there are no closing figures."),
        _ => {}
    }
    if source.log.is_none() {
        say(
            "there is no <code>log.csv</code>, so there are no figures over time; a run writes it with <code>--out</code>.",
        );
    }
    if source.timings.is_none() && source.summary.is_some() {
        say("there is no <code>timings.csv</code>, so the time of each rank is unknown; a run writes it with \
             <code>--out</code> at its end.");
    }
    if source.recording.is_none() {
        say("nothing is recorded, so there are no pictures; <code>atoll run --record-every K</code> records.");
    }
    text
}

fn key_figures(source: &Source) -> String {
    let mut text = String::from("<div class=\"tiles\">\n");
    let mut tile = |name: &str, value: String, more: String| {
        writeln!(text, "<div class=\"tile\"><span>{name}</span><strong>{value}</strong><em>{more}</em></div>")
            .expect("a string takes any text");
    };
    let number = |key| source.number(key);
    if let Some(steps) = source.steps() {
        tile("Steps", Whole(steps).to_string(), format!("{} of the world", Unit(source.time(steps as f64), "s")));
    }
    if let Some((ms, wall)) = number("ms_per_step").zip(number("wall_s")) {
        tile("Per step", format!("{} ms", Short3(ms)), format!("{} s in all", Short3(wall)));
    }
    if let (Some(ms), bodies) = (number("ms_per_step"), source.config.scene.bodies as f64) {
        let rate = bodies * 1e3 / ms;
        tile("Bodies stepped", format!("{}/s", Short(rate)), whole(bodies as u64, "body"));
    }
    if let Some((contacts, border)) = number("contacts").zip(number("border_contact_fraction")) {
        tile("Contacts", Whole(contacts as u64).to_string(), format!("{:.2} % across tiles", 100.0 * border));
    }
    if let Some((most, mean)) = number("max_penetration").zip(number("mean_penetration")) {
        tile("Deepest overlap", Unit(most, "m").to_string(), format!("mean {}", Unit(mean, "m")));
    }
    if let Some(bytes) = number("peak_rss_bytes") {
        let each = bytes / (source.config.scene.bodies as f64).max(1.0);
        tile("Memory", Unit(bytes, "B").to_string(), format!("{} per body", Unit(each, "B")));
    }
    text + "</div>\n"
}

/// As many digits as tell something, without suffix.
struct Short3(f64);

impl std::fmt::Display for Short3 {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0.abs() {
            100.0.. => write!(f, "{:.0}", self.0),
            10.0.. => write!(f, "{:.1}", self.0),
            1.0.. => write!(f, "{:.2}", self.0),
            _ => write!(f, "{:.3}", self.0),
        }
    }
}

/// What there is to know about the runs, a column for each.
fn facts(sources: &[Source]) -> String {
    type Fact = fn(&Source) -> Option<String>;
    fn word(source: &Source, key: &str) -> Option<String> {
        source.word(key).map(|word| format!("<code>{}</code>", Text(word)))
    }
    fn whole(source: &Source, key: &str) -> Option<String> {
        source.number(key).map(|number| Whole(number as u64).to_string())
    }
    let rows: [(&str, Fact); 21] = [
        ("Scene", |source| Some(Text(&source.config.scene.kind.title()).to_string())),
        ("Seed", |source| Some(source.config.scene.seed.to_string())),
        ("Bodies", |source| Some(Whole(source.config.scene.bodies).to_string())),
        ("Steps", |source| {
            let (made, all) = (source.steps()?, source.config.run.steps);
            Some(format!("{} of {}, {} each", Whole(made), Whole(all), Unit(source.time(1.0), "s")))
        }),
        ("Tiles", |source| {
            let how = source.config.run.retiling.map(|retiling| retiling.how);
            Some(Text(&tiles::in_words(source.tiles(), how).replace(" x ", " \u{d7} ")).to_string())
        }),
        ("Ranks and threads", |source| {
            let ranks = source.number("ranks").unwrap_or(source.config.run.ranks as f64);
            let threads = source.number("threads").or(source.config.run.threads.map(|threads| threads as f64));
            let threads = threads.map_or_else(|| "all cores".to_owned(), |threads| threads.to_string());
            let transport = source.word("transport").unwrap_or(source.config.transport().name());
            Some(format!("{ranks} ({}), {threads} each", Text(transport)))
        }),
        ("Machine", |source| Some(Text(source.word("machine")?).to_string())),
        ("Went on after step", |source| whole(source, "resumed_at").filter(|step| step != "0")),
        ("Version", |source| Some(Text(source.word("version")?).to_string())),
        ("Bodies lost, escaped", |source| {
            Some(format!("{}, {}", source.number("bodies_lost")?, source.number("escaped")?))
        }),
        ("Islands", |source| {
            let (islands, largest) = (whole(source, "islands")?, whole(source, "largest_island")?);
            let asleep = whole(source, "asleep").filter(|asleep| asleep != "0");
            let asleep = asleep.map(|asleep| format!(", {asleep} bodies asleep")).unwrap_or_default();
            let within = whole(source, "tile_count").filter(|tiles| tiles != "1").map_or("", |_| " within tiles");
            Some(format!("{islands}{within}, the largest of {largest} bodies{asleep}"))
        }),
        ("Mass", |source| Some(Unit(source.number("mass")? * 1e3, "g").to_string())),
        ("Kinetic energy", |source| Some(Unit(source.number("kinetic_energy")?, "J").to_string())),
        ("Sent between ranks", |source| {
            let (bytes, messages) = (source.number("bytes_sent")?, whole(source, "messages_sent")?);
            Some(format!("{} in {messages} messages", Unit(bytes, "B")))
        }),
        ("Commands", |source| {
            source.commands.map(|count| format!("{}, in <code>commands.jsonl</code>", plural(count, "line")))
        }),
        ("Migrations", |source| {
            let since = whole(source, "resumed_at").filter(|step| step != "0");
            let since = since.map(|step| format!(", since step {step}")).unwrap_or_default();
            whole(source, "migrations").map(|count| count + &since)
        }),
        ("Memory at most", |source| Some(Unit(source.number("peak_rss_bytes")?, "B").to_string())),
        ("On disk", |source| {
            let [recording, snapshots] = source.size.map(|size| Unit(size as f64, "B").to_string());
            let records = source.recording.as_ref().map_or(0, |recording| recording.steps().len());
            Some(format!("{records} records in {recording}, snapshots in {snapshots}"))
        }),
        ("Configuration hash", |source| Some(format!("<code>{}</code>", source.config.hash(source.tiles())))),
        ("State hash", |source| word(source, "state_hash")),
        ("Contact hash", |source| word(source, "contact_hash")),
    ];
    let head = if sources.len() > 1 { vec![String::new(), "A".to_owned(), "B".to_owned()] } else { Vec::new() };
    let row = |(name, fact): (&str, Fact)| {
        let values: Vec<Option<String>> = sources.iter().map(fact).collect();
        let cells = values.iter().map(|value| value.clone().unwrap_or_else(|| "\u{2013}".to_owned()));
        values.iter().any(Option::is_some).then(|| [name.to_owned()].into_iter().chain(cells).collect::<Vec<_>>())
    };
    table(&head, &rows.into_iter().filter_map(row).collect::<Vec<_>>())
}

/// Every value that was used, folded; of two runs first those that differ.
pub(super) fn configuration(sources: &[Source]) -> String {
    let mut text = String::from("<h2>Configuration</h2>\n");
    if let [a, b] = sources {
        let [ours, theirs] = [a, b].map(|one| one.config.canonical(one.tiles()));
        let row = |one: config::Difference| {
            vec![format!("<code>{}</code>", Text(&one.key)), Text(&one.ours).to_string(), Text(&one.theirs).to_string()]
        };
        let rows: Vec<_> = config::differences(&ours, &theirs).into_iter().map(row).collect();
        if rows.is_empty() {
            text.push_str("<p>Both runs have the same values wherever the result depends on them.</p>\n");
        } else {
            text.push_str(&table(&["Differs".to_owned(), "A".to_owned(), "B".to_owned()], &rows));
        }
    }
    for (run, source) in sources.iter().enumerate() {
        let of = if sources.len() > 1 { format!(" of {}", letter(run)) } else { String::new() };
        writeln!(text, "<details><summary>run.toml{of}</summary><pre>{}</pre></details>", Text(&source.text))
            .expect("a string takes any text");
    }
    text
}
