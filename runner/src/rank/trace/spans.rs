//! What listens to spans, where somebody wants a trace.

use super::store;
use atoll_core::Phase;
use std::fmt::Debug;
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::subscriber::Interest;
use tracing::{Metadata, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::LevelFilter;
use tracing_subscriber::layer::{Context, Filter};
use tracing_subscriber::registry::LookupSpan;

/// Keeps the spans of threads that were told to, beside whatever else listens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spans;

impl Spans {
    /// A layer for a subscriber.
    pub(crate) fn layer<S: Subscriber + for<'a> LookupSpan<'a>>() -> impl Layer<S> {
        Self.with_filter(OfThisProgram)
    }
}

impl<S: Subscriber> Layer<S> for Spans {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, _: Context<'_, S>) {
        let mut fields = Fields { name: attributes.metadata().name(), of: None };
        attributes.record(&mut fields);
        store::open(id, fields.name, fields.of);
    }

    fn on_enter(&self, id: &Id, _: Context<'_, S>) {
        store::enter(id);
    }

    fn on_exit(&self, id: &Id, _: Context<'_, S>) {
        store::exit(id);
    }

    fn on_close(&self, id: Id, _: Context<'_, S>) {
        store::close(&id);
    }
}

/// The spans that are there to be traced.
struct OfThisProgram;

impl OfThisProgram {
    fn has(metadata: &Metadata<'_>) -> bool {
        metadata.is_span() && *metadata.level() == LevelFilter::TRACE && metadata.target().starts_with("atoll")
    }
}

impl<S> Filter<S> for OfThisProgram {
    fn enabled(&self, metadata: &Metadata<'_>, _: &Context<'_, S>) -> bool {
        store::is_on() && Self::has(metadata)
    }

    /// Asked once for each place in the code.
    fn callsite_enabled(&self, metadata: &'static Metadata<'static>) -> Interest {
        if Self::has(metadata) { Interest::sometimes() } else { Interest::never() }
    }

    fn max_level_hint(&self) -> Option<LevelFilter> {
        Some(LevelFilter::TRACE)
    }
}

/// What a span says of itself: the phase, where it is a stage of one, and a number.
struct Fields {
    name: &'static str,
    of: Option<(&'static str, u64)>,
}

impl Visit for Fields {
    fn record_u64(&mut self, field: &Field, value: u64) {
        self.of = Some((field.name(), value));
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        let phase = Phase::ALL.into_iter().map(Phase::name).find(|name| field.name() == "name" && *name == value);
        self.name = phase.unwrap_or(self.name);
    }

    fn record_debug(&mut self, _: &Field, _: &dyn Debug) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use tracing::{info_span, trace_span};
    use tracing_subscriber::prelude::*;

    #[test]
    fn spans_are_kept_while_the_thread_is_told_to() {
        let _guard = tracing::subscriber::set_default(tracing_subscriber::registry().with(Spans::layer()));
        let spans = || {
            let _rank = info_span!("rank", rank = 3_u32).entered();
            let _step = trace_span!("step", step = 7_u64).entered();
            for tile in 0..2_u32 {
                drop(trace_span!("stage", name = "solve_nothing", tile).entered());
                drop(trace_span!("stage", name = "substeps", tile).entered());
            }
            // Made, and never entered.
            drop(trace_span!("wait"));
        };
        spans();
        store::turn(true, 4);
        spans();
        store::turn(false, 4);
        spans();
        let all = store::take();
        let found: Vec<_> = all.slices.iter().map(|slice| (slice.name, slice.of)).collect();
        let expected = ["stage", "substeps", "stage", "substeps"].into_iter().zip([0, 0, 1, 1]);
        assert_eq!(found, expected.map(|(name, tile)| (name, Some(("tile", tile)))).collect::<Vec<_>>());
        // There was no room for the step.
        assert_eq!((all.left_out, store::take().slices.len()), (1, 0));
        assert!(all.slices.windows(2).all(|pair| pair[0].start <= pair[0].end && pair[0].end <= pair[1].start));
    }
}
