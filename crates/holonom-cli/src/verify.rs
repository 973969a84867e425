//! `holonom verify`: the certificate of a model.

use holonom::RunFolder;
use holonom::certificate::page::{page, rest, sentence, verdict};
use holonom::certificate::{ModelCertificate, Provenance, certify_model, now};
use holonom::verification::certificate::Verdict;
use holonom::verification::table::{Cell, CertificateTable, remarks, tables};

use crate::arguments::VerifyArguments;
use crate::failure::Failure;
use crate::human::paragraph;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::{stderr, stdout};

pub(crate) fn verify(arguments: &VerifyArguments) -> Result<(), Failure> {
    let overrides = arguments.model.set.clone();
    let input = ModelInput::new(&arguments.model, overrides.clone(), arguments.json);
    let (model, _) = input.assemble()?;
    let path = &arguments.model.model;
    let folder = arguments.output.clone().unwrap_or_else(|| RunFolder::default_for(path, "verify"));
    RunFolder::vacant(&folder, &["certificate.json", "certificate.html"], arguments.force)?;
    let mut progress = |what: &str| {
        if !arguments.quiet {
            stderr::line(&format!("  {what}"));
        }
    };
    let mut certificate = certify_model(&model, arguments.accuracy, &mut progress)
        .map_err(|message| Failure::Usage { message, help: String::new() })?;
    certificate.provenance = Some(Provenance::new(
        command(),
        now(),
        input.text().text().unwrap_or_default(),
        &overrides,
    ));
    let folder = RunFolder::open(folder);
    let json = serde_json::to_value(&certificate).unwrap_or_default();
    let files = [
        folder.write("certificate.json", &format!("{json:#}\n"))?,
        folder.write("certificate.html", &page(&certificate, &model))?,
    ];
    if !arguments.quiet {
        stderr::print(&words(&certificate, arguments.tables));
        let files = files.map(|file| file.display().to_string());
        stderr::line(&format!("  written: {}", files.join(", ")));
    }
    if arguments.json {
        match stdout::json(&json) {
            Err(Failure::Closed) => {} // the exit code counts even if nobody reads
            other => other?,
        }
    }
    if certificate.holds { Ok(()) } else { Err(Failure::Property(verdict(&certificate))) }
}

/// The certificate for a terminal: the verdict, recommended steps, what fails; all tables and
/// remarks where they are asked for.
pub(crate) fn words(certificate: &ModelCertificate, all: bool) -> String {
    let mut text = paragraph(&format!("{}: {}", certificate.model, verdict(certificate)), "");
    rest(certificate).iter().for_each(|said| text += &paragraph(said, "  "));
    for step in &certificate.steps {
        text += &paragraph(&sentence(step, certificate.accuracy), "  ");
    }
    let fails = |remark: &&String| remark.starts_with(Verdict::Fail.name());
    let remarks = remarks(&certificate.certificate);
    if all {
        tables(&certificate.certificate).iter().for_each(|of| text += &table(of));
        text.push('\n');
        remarks.iter().for_each(|remark| text += &paragraph(remark, "  "));
    } else {
        remarks.iter().filter(fails).for_each(|remark| text += &paragraph(remark, "  "));
        text += "  tables and remarks: on the page, or with --tables\n";
    }
    text
}

fn table(table: &CertificateTable) -> String {
    let row = |(name, cells): &(String, Vec<Cell>)| -> Vec<String> {
        std::iter::once(name.clone()).chain(cells.iter().map(cell)).collect()
    };
    let rows: Vec<Vec<String>> = table.rows.iter().map(row).collect();
    let width = |column: usize| {
        let of = rows.iter().chain([&table.header]).filter_map(|row| row.get(column));
        of.map(|text| text.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..table.header.len()).map(width).collect();
    let line = |cells: &[String]| {
        let padded = cells.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        format!("  {}\n", padded.collect::<Vec<_>>().join("  ").trim_end())
    };
    let body: String = rows.iter().map(|row| line(row)).collect();
    format!("\n{}\n{}{body}", table.title, line(&table.header))
}

fn cell(cell: &Cell) -> String {
    match cell.verdict {
        Some(Verdict::Fail) => format!("{} FAIL", cell.text),
        Some(Verdict::KnownDeviation) => format!("{} (known deviation)", cell.text),
        _ => cell.text.clone(),
    }
}
