//! Writes one object in millimetres.

use super::super::output::{Precision, WriteError};
use super::super::runs::Runs;
use super::super::text;
use std::io::{self, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;

const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;

const BEFORE: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources><object id="1" type="model"><mesh><vertices>
"#;

const BETWEEN: &str = "</vertices><triangles>\n";

const AFTER: &str =
    "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>\n";

/// A quick compression: the text shrinks to a third, the slowest to a quarter.
const LEVEL: i64 = 1;

/// Writes `mesh` as the only object of a 3MF archive.
pub(in super::super) fn write(
    mesh: &dyn Runs,
    precision: Precision,
    out: &mut dyn Write,
) -> Result<(), WriteError> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(LEVEL))
        .last_modified_time(DateTime::default())
        .large_file(true);
    let mut archive = ZipWriter::new_stream(out);
    for (name, content) in [("[Content_Types].xml", CONTENT_TYPES), ("_rels/.rels", RELATIONS)] {
        archive.start_file(name, options).map_err(io::Error::from)?;
        archive.write_all(content.as_bytes())?;
    }
    archive.start_file("3D/3dmodel.model", options).map_err(io::Error::from)?;
    archive.write_all(BEFORE.as_bytes())?;
    mesh.vertices(&mut |run| {
        text::write_rows(run, &mut archive, |row, point| {
            for (axis, value) in ["<vertex x=\"", "\" y=\"", "\" z=\""].into_iter().zip(point) {
                row.extend_from_slice(axis.as_bytes());
                text::push_number(row, *value, precision)?;
            }
            row.extend_from_slice(b"\"/>\n");
            Ok(())
        })
    })?;
    archive.write_all(BETWEEN.as_bytes())?;
    mesh.triangles(&mut |run| {
        text::write_rows(run, &mut archive, |row, [a, b, c]| {
            Ok(writeln!(row, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")?)
        })
    })?;
    archive.write_all(AFTER.as_bytes())?;
    archive.finish().map_err(io::Error::from)?;
    Ok(())
}
