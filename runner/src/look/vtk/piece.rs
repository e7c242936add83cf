//! One `.vtu`: polygons, and columns of what is known of each. How long everything is follows from counts, so the whole is
//! written in one go, and nothing of it is kept.

use super::outline::Outline;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};

/// Bytes on their way to the file.
const BUFFER: usize = 1 << 18;

/// Where values are written to.
pub(super) type Output<'a> = BufWriter<&'a mut File>;

/// How a number is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    /// One byte.
    UInt8,
    /// Four bytes.
    UInt32,
    /// Eight bytes.
    Int64,
    /// Eight bytes.
    UInt64,
    /// Four bytes.
    Float32,
    /// Eight bytes.
    Float64,
}

impl Form {
    /// As VTK calls it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::UInt8 => "UInt8",
            Self::UInt32 => "UInt32",
            Self::Int64 => "Int64",
            Self::UInt64 => "UInt64",
            Self::Float32 => "Float32",
            Self::Float64 => "Float64",
        }
    }

    fn bytes(self) -> u64 {
        match self {
            Self::UInt8 => 1,
            Self::UInt32 | Self::Float32 => 4,
            Self::Int64 | Self::UInt64 | Self::Float64 => 8,
        }
    }
}

/// Writes the numbers of a column, in little-endian order.
pub(super) type Values<'a> = Box<dyn Fn(&mut Output<'_>) -> io::Result<()> + 'a>;

/// So many numbers for each polygon.
pub(super) struct Column<'a> {
    /// Its name.
    pub(super) name: &'static str,
    /// How its numbers are written.
    pub(super) form: Form,
    /// How many each polygon has.
    pub(super) components: usize,
    /// Writes all of them.
    pub(super) values: Values<'a>,
}

/// How a file of some type begins.
pub(super) fn heading(of: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{of}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n"
    )
}

/// What the XML says of the bytes behind it.
#[derive(Default)]
struct Arrays {
    text: String,
    /// Bytes of each.
    lengths: Vec<u64>,
    /// Where the next one begins.
    offset: u64,
}

impl Arrays {
    /// One more, of so many numbers.
    fn add(&mut self, name: &str, form: Form, components: usize, tuples: u64) {
        let offset = self.offset;
        writeln!(
            self.text,
            "    <DataArray type=\"{}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" \
             offset=\"{offset}\"/>",
            form.name()
        )
        .expect("a string takes any text");
        let length = tuples * components as u64 * form.bytes();
        self.lengths.push(length);
        // Each has its length before it.
        self.offset += 8 + length;
    }
}

/// Writes polygons with columns of what is known of them. `attributes` says which columns are what.
///
/// # Errors
/// What the system says.
pub(super) fn write<'a>(
    outlines: impl Iterator<Item = Outline<'a>> + Clone,
    columns: &[Column<'_>],
    attributes: &str,
    file: &mut File,
) -> io::Result<()> {
    let (mut cells, mut points) = (0, 0);
    outlines.clone().for_each(|outline| {
        cells += 1;
        points += outline.corners() as u64;
    });
    let mut arrays = Arrays::default();
    arrays.text += "   <Points>\n";
    arrays.add("Points", Form::Float64, 3, points);
    arrays.text += "   </Points>\n   <Cells>\n";
    arrays.add("connectivity", Form::Int64, 1, points);
    arrays.add("offsets", Form::Int64, 1, cells);
    arrays.add("types", Form::UInt8, 1, cells);
    writeln!(arrays.text, "   </Cells>\n   <CellData {attributes}>").expect("a string takes any text");
    columns.iter().for_each(|column| arrays.add(column.name, column.form, column.components, cells));
    arrays.text += "   </CellData>\n";

    let mut out = BufWriter::with_capacity(BUFFER, file);
    write!(
        out,
        "{} <UnstructuredGrid>\n  <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">\n{}  </Piece>\n \
         </UnstructuredGrid>\n <AppendedData encoding=\"raw\">\n_",
        heading("UnstructuredGrid"),
        arrays.text
    )?;
    let mut lengths = arrays.lengths.iter();
    let mut begin = |out: &mut Output<'_>| {
        let length = lengths.next().expect("as many are written as were announced");
        out.write_all(&length.to_le_bytes())
    };
    begin(&mut out)?;
    for outline in outlines.clone() {
        for number in 0..outline.corners() {
            let corner = outline.corner(number);
            out.write_all(&corner.x.to_le_bytes())?;
            out.write_all(&corner.y.to_le_bytes())?;
            out.write_all(&0_f64.to_le_bytes())?;
        }
    }
    begin(&mut out)?;
    (0..points).try_for_each(|point| out.write_all(&point.to_le_bytes()))?;
    begin(&mut out)?;
    let mut end = 0;
    for outline in outlines.clone() {
        end += outline.corners() as u64;
        out.write_all(&end.to_le_bytes())?;
    }
    begin(&mut out)?;
    outlines.clone().try_for_each(|outline| out.write_all(&[outline.cell_type()]))?;
    for column in columns {
        begin(&mut out)?;
        (column.values)(&mut out)?;
    }
    out.write_all(b"\n </AppendedData>\n</VTKFile>\n")?;
    out.flush()
}
