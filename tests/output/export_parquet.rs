//! Tables of a run as Parquet files, read back by Arrow.
#![allow(clippy::unwrap_used)] // a test

use crate::output::export::{compared, python, run};
use crate::program::command::{folder, holonom, words};

const COMPARE: &str = r#"
import csv, os, pyarrow, pyarrow.parquet
types = {"step": pyarrow.int64(), "element": pyarrow.int64(), "beam": pyarrow.string()}
read = {"step": int, "element": int, "beam": str}
compared = empty = 0
tables = sorted(os.listdir("run-parquet"))
for file in tables:
    table = pyarrow.parquet.read_table("run-parquet/" + file)
    rows = list(csv.reader(open("run/" + file.replace(".parquet", ".csv"))))
    head, rows = rows[0], rows[1:]
    assert table.column_names == head and table.num_rows == len(rows) > 0, file
    for k, name in enumerate(head):
        assert table.schema.types[k] == types.get(name, pyarrow.float64()), name
        for value, row in zip(table.column(k).to_pylist(), rows):
            assert value == (read.get(name, float)(row[k]) if row[k] else None), (file, name)
            empty += value is None
            compared += 1
csvs = [f[:-4] for f in os.listdir("run") if f.endswith(".csv")]
assert sorted(csvs) == [t[:-8] for t in tables], (csvs, tables)
print(len(tables), compared, empty)
"#;

#[test]
fn arrow_reads_the_numbers_of_the_files_bit_for_bit() {
    let Some(python) = python("pyarrow.parquet") else { return };
    let mut files = Vec::new();
    let models = ["slider_crank.toml", "flying_beam.toml", "four_particles.toml", "pendulum.toml"];
    for (model, steps) in models.into_iter().zip([20, 20, 20, 66_000]) {
        let folder = folder("export_parquet", model);
        run(&folder, model, steps); // 66,000 rows: two groups
        let output = holonom(&folder, &["export", "run", "--format", "parquet"]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let said = compared(&python, COMPARE, &folder);
        println!("{model}: files, values, empty fields: {said}");
        let number = |k: usize| said.split(' ').nth(k).unwrap().parse::<u32>().unwrap();
        assert!(number(1) > 100);
        files.push(number(0));
    }
    assert!(files.iter().any(|&n| n >= 4), "{files:?}");
}

#[test]
fn only_a_folder_of_tables_is_replaced() {
    let folder = folder("export_parquet", "replaced");
    run(&folder, "pendulum.toml", 5);
    let export = || holonom(&folder, &["export", "run", "--format", "parquet", "--force"]);
    for _ in 0..2 {
        let output = export();
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    }
    let table = folder.join("run-parquet/trajectory.parquet");
    let bytes = std::fs::read(&table).unwrap();
    assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"), "{} bytes", bytes.len());
    std::fs::write(folder.join("run-parquet/notes.txt"), "mine").unwrap();
    let output = export();
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("notes.txt is in it"), "{}", words(&output));
    assert_eq!(std::fs::read(&table).unwrap(), bytes, "the old table stays");
}
