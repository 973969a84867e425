//! Measured values, as `identify` reads them.

use super::{Answer, FuzzTarget, Worker, files};
use holonom::Model;
use holonom::identification::data;

/// Files of measured values.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredValues;

/// A model with two columns.
const MODEL: &str = "\
[model]
name = \"measured\"
[simulation]
step = 0.1
end = 1.0
[[particle]]
name = \"bob\"
mass = 1.0
position = [0.0, 0.0, 0.0]
[[sensor]]
name = \"place\"
type = \"position\"
of = \"bob\"
[[measurement]]
sensor = \"place.z\"
column = \"height\"
sigma = 0.1
[[measurement]]
sensor = \"place.x\"
column = \"far\"
sigma = 0.1
";

impl FuzzTarget for MeasuredValues {
    fn name(&self) -> &'static str {
        "measured"
    }

    fn executions(&self) -> u64 {
        1_000_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        files("tests/corpus/measured", 1 << 16)
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(MeasuredReader(Model::from_toml(MODEL).expect("a valid model")))
    }
}

struct MeasuredReader(Model);

impl Worker for MeasuredReader {
    fn execute(&mut self, input: &[u8]) -> Answer {
        self.read(input, 1.0)
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        self.read(input, f64::INFINITY)
    }
}

impl MeasuredReader {
    /// Whether values are finite, at times that increase within the run.
    fn read(&self, input: &[u8], factor: f64) -> Answer {
        let text = String::from_utf8_lossy(input);
        let columns = match data::read("data.csv", &text, &self.0) {
            Ok(columns) => columns,
            Err(error) if error.help.is_empty() => return Answer::Wrong("no remedy".to_owned()),
            Err(error) => return Answer::Refused(error.message),
        };
        for own in &columns {
            let increase = own.times.windows(2).all(|pair| pair[0] < pair[1]);
            let within = own.times.iter().all(|t| (0.0..=1.0 + 1e-9).contains(t));
            let finite = own.values.iter().all(|x| (factor * (1.0 + x.abs())).is_finite());
            if !(increase && within && finite) || own.times.len() != own.values.len() {
                return Answer::Wrong(format!("accepted: {own:?}"));
            }
        }
        Answer::Accepted
    }
}
