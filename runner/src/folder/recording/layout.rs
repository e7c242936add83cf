//! The columns of a recording and how each is encoded.
//!
//! Measured on 700,000 bodies of `configs/normal.toml` at step 300, on one core: plain values take 40 bytes a body and
//! 22 ms to encode; ids as differences bring that to 34 bytes in the same time; floats with their bytes sorted by
//! significance and compressed with Snappy to 28 bytes (25 in the first steps) and 36 ms. LZ4 does as Snappy does; zstd
//! gets 27 bytes and needs a C compiler. Kinds as numbers of a dictionary take a bit a body where there are two.

use super::facts::Format;
use parquet::basic::{Compression, Encoding};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesPtr};
use parquet::schema::parser::parse_message_type;
use parquet::schema::types::{ColumnPath, TypePtr};
use std::sync::Arc;

/// The columns of the first format, which all others have as well.
const STATES: &str = "
    required int32 step (INTEGER(32, false));
    required int64 id (INTEGER(64, false));
    required double x;
    required double y;
    required float angle;
    required float vx;
    required float vy;
    required float omega;";

/// The column that the second brought.
const KIND: &str = "
    required int32 kind (INTEGER(32, false));";

/// The columns of a format.
pub(super) fn schema(format: Format) -> TypePtr {
    let kind = match format {
        Format::StatesAlone => "",
        Format::WithStage => KIND,
    };
    let text = format!("message atoll {{{STATES}{kind}\n}}");
    Arc::new(parse_message_type(&text).expect("the schema is well formed"))
}

/// How the pages of a column are compressed.
pub(super) fn compression(column: &ColumnPath) -> Compression {
    match column.string().as_str() {
        "step" | "id" | "kind" => Compression::UNCOMPRESSED,
        _ => Compression::SNAPPY,
    }
}

/// How files are written that say this about themselves.
pub(super) fn properties(facts: Vec<KeyValue>) -> WriterPropertiesPtr {
    let mut builder = WriterProperties::builder()
        .set_created_by(concat!("atoll version ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(facts))
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_offset_index_disabled(true)
        // Pages of a mebibyte, which compress better than the usual ones of 20,000 rows.
        .set_data_page_row_count_limit(usize::MAX);
    for column in schema(Format::WithStage).get_fields() {
        let column = ColumnPath::from(column.name());
        builder = builder.set_column_compression(column.clone(), compression(&column));
        builder = match column.string().as_str() {
            // One value all over: a dictionary of one. Statistics, so that tools can pass over records they do not want.
            "step" => builder
                .set_column_statistics_enabled(column.clone(), EnabledStatistics::Chunk)
                .set_column_dictionary_enabled(column, true),
            // Few values, of a bit or a few each; in runs, where bodies of one kind lie side by side.
            "kind" => builder.set_column_dictionary_enabled(column, true),
            "id" => builder
                .set_column_statistics_enabled(column.clone(), EnabledStatistics::Chunk)
                .set_column_encoding(column, Encoding::DELTA_BINARY_PACKED),
            _ => builder.set_column_encoding(column, Encoding::BYTE_STREAM_SPLIT),
        };
    }
    Arc::new(builder.build())
}
