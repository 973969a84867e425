//! The findings of a certificate as tables: a row for each method and order, a column for each
//! property.

use super::certificate::{Certificate, Criterion, Finding, Verdict};
use super::subject::SteppingMethod;

/// An entry of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    /// What was measured, short; empty where nothing was.
    pub text: String,
    /// The judgement.
    pub verdict: Option<Verdict>,
}

/// A table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CertificateTable {
    /// What it shows.
    pub title: String,
    /// Its columns; the first names the row.
    pub header: Vec<String>,
    /// Its rows.
    pub rows: Vec<(String, Vec<Cell>)>,
}

/// The tables of a certificate: orders; conserved quantities; schemes among one another.
#[must_use]
pub fn tables(certificate: &Certificate) -> Vec<CertificateTable> {
    let tables = [
        pivot(certificate, "Observed orders", &[Criterion::Order], order_cell),
        pivot(
            certificate,
            "Outputs against the equations of motion",
            &[Criterion::Output],
            plain_cell,
        ),
        pivot(
            certificate,
            "Conserved quantities and constraints",
            &[
                Criterion::Energy,
                Criterion::Momentum,
                Criterion::Residual,
                Criterion::Reversal,
                Criterion::Symplecticity,
            ],
            plain_cell,
        ),
        pivot(
            certificate,
            "Conditioning and agreement",
            &[Criterion::Conditioning, Criterion::Agreement],
            plain_cell,
        ),
        list(certificate),
    ];
    tables.into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// Column of a finding: momentum maps share one.
fn column(finding: &Finding) -> String {
    match finding.criterion {
        Criterion::Momentum => "momentum maps".into(),
        Criterion::Energy => "energy".into(),
        _ => finding.quantity.clone(),
    }
}

fn row(method: SteppingMethod, order: u32) -> String {
    format!("{} {order}", method.name())
}

fn pivot(
    certificate: &Certificate,
    title: &str,
    criteria: &[Criterion],
    cell: fn(&[&Finding]) -> Cell,
) -> CertificateTable {
    let chosen: Vec<&Finding> = certificate
        .findings
        .iter()
        .filter(|f| criteria.contains(&f.criterion) && f.method.is_some())
        .collect();
    let (mut columns, mut rows): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    let name = |f: &Finding| f.method.map_or(String::new(), |method| row(method, f.order));
    for finding in &chosen {
        let (column, row) = (column(finding), name(finding));
        if !columns.contains(&column) {
            columns.push(column);
        }
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    let at = |row: &String, of: &String| -> Cell {
        let here: Vec<&Finding> =
            chosen.iter().copied().filter(|f| name(f) == *row && column(f) == *of).collect();
        cell(&here)
    };
    let line = |row: String| {
        let cells = columns.iter().map(|column| at(&row, column)).collect();
        (row, cells)
    };
    let rows: Vec<(String, Vec<Cell>)> = rows.into_iter().map(line).collect();
    let header = std::iter::once("scheme, order".to_owned()).chain(columns).collect();
    CertificateTable { title: title.to_owned(), header, rows }
}

/// Findings that belong to no method.
fn list(certificate: &Certificate) -> CertificateTable {
    let header = ["", "expected", "measured"].map(str::to_owned).to_vec();
    let chosen = certificate.findings.iter().filter(|f| f.method.is_none());
    let rows = chosen.map(|f| {
        let expected = Cell { text: f.expected.clone(), verdict: None };
        let measured = Cell { text: f.measured.clone(), verdict: Some(f.verdict) };
        (f.quantity.clone(), vec![expected, measured])
    });
    CertificateTable { title: "Closed forms".into(), header, rows: rows.collect() }
}

fn order_cell(findings: &[&Finding]) -> Cell {
    findings.first().map_or_else(Cell::default, |f| {
        let text = match (f.value, f.verdict) {
            (Some(order), _) => format!("{order:.2}"),
            (None, Verdict::Pass) => "exact".into(),
            (None, verdict) if !verdict.is_judged() => "–".into(),
            (None, _) => f.measured.clone(),
        };
        Cell { text, verdict: Some(f.verdict) }
    })
}

/// One finding as it is, of several the worst.
fn plain_cell(findings: &[&Finding]) -> Cell {
    let rank = |f: &&&Finding| f.verdict.severity();
    let value = |f: &&&Finding| f.value.unwrap_or(f64::NEG_INFINITY);
    let worst =
        findings.iter().max_by(|a, b| rank(a).cmp(&rank(b)).then(value(a).total_cmp(&value(b))));
    worst.map_or_else(Cell::default, |f| {
        let text = match (f.measured.is_empty(), f.criterion) {
            (true, _) => "–".into(),
            (_, Criterion::Momentum) => format!("{}: {}", f.quantity, f.measured),
            _ => f.measured.clone(),
        };
        Cell { text, verdict: Some(f.verdict) }
    })
}

/// Every finding that is no plain pass, in a sentence; the same reason is given once.
#[must_use]
pub fn remarks(certificate: &Certificate) -> Vec<String> {
    let mut remarks: Vec<(String, Vec<String>)> = Vec::new();
    for finding in certificate.findings.iter().filter(|f| f.verdict != Verdict::Pass) {
        let of = finding.method.map_or(String::new(), |m| row(m, finding.order));
        let measured = match finding.measured.as_str() {
            "" => String::new(),
            measured if finding.verdict == Verdict::Fail => {
                format!(" {measured}, expected {}", finding.expected)
            }
            _ => String::new(),
        };
        let reason =
            if finding.reason.is_empty() { String::new() } else { format!(": {}", finding.reason) };
        let sentence = format!(
            "{}, {} {}{measured}{reason}",
            finding.verdict.name(),
            finding.criterion.name(),
            finding.quantity
        );
        match remarks.iter_mut().find(|r| r.0 == sentence) {
            Some((_, of_all)) => of_all.push(of),
            None => remarks.push((sentence, vec![of])),
        }
    }
    let with_schemes = |(sentence, of): (String, Vec<String>)| {
        let of: Vec<String> = of.into_iter().filter(|name| !name.is_empty()).collect();
        if of.is_empty() { sentence } else { format!("{sentence} ({})", of.join("; ")) }
    };
    remarks.into_iter().map(with_schemes).collect()
}
