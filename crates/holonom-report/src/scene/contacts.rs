//! Contacts of bodies at the instants of a scene: points, forces, whether they slip.

use std::collections::HashMap;

use holonom_sim::contacts::ContactPhase;
use holonom_sim::output::ContactRow;
use serde::Serialize;

use super::encoded;

/// The contacts of all instants, one after the other.
#[derive(Debug, Default, Serialize)]
pub(super) struct SceneContacts {
    /// Where those of each instant begin, and where the last ones end; empty without contacts.
    starts: Vec<usize>,
    /// Of each the point, the force on the second body, and what it does: 0 sticks, 1 slips, 2 is
    /// hit.
    values: String,
}

impl SceneContacts {
    /// Those of the rows of a run at these instants.
    pub(super) fn new(times: &[f64], rows: &[ContactRow]) -> Self {
        if rows.is_empty() {
            return Self::default();
        }
        let mut at: HashMap<u64, Vec<&ContactRow>> = HashMap::new();
        rows.iter().for_each(|row| at.entry(row.t.to_bits()).or_default().push(row));
        let (mut starts, mut values) = (vec![0], Vec::new());
        for time in times {
            for row in at.get(&time.to_bits()).into_iter().flatten() {
                let state = match row.state {
                    ContactPhase::Stick => 0.0,
                    ContactPhase::Slip => 1.0,
                    ContactPhase::Impact => 2.0,
                };
                values.extend(row.point().into_iter().chain(row.force()).chain([state]));
            }
            starts.push(values.len() / NUMBERS);
        }
        Self { starts, values: encoded(values.into_iter()) }
    }
}

/// Numbers of a contact.
const NUMBERS: usize = 7;

#[cfg(test)]
mod tests {
    use super::*;

    fn row(t: f64, normal: f64) -> ContactRow {
        let text = "step,t,contact,a,b,feature,x,y,z,nx,ny,nz,gap,normal,tx,ty,tz,slip,state\n";
        let text =
            format!("{text}1,{t:?},floor,ground,ball,0,1,2,3,0,0,1,0,{normal:?},4,5,6,0.1,slip\n");
        let mut rows = csv_rows(&text);
        rows.remove(0)
    }

    fn csv_rows(text: &str) -> Vec<ContactRow> {
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let object = |line: &str| {
            let pairs = names.iter().zip(line.split(',')).map(|(name, field)| {
                let value =
                    field.parse::<f64>().map_or_else(|_| field.into(), serde_json::Value::from);
                let value = match *name {
                    "step" | "feature" => {
                        serde_json::Value::from(field.parse::<u64>().unwrap_or(0))
                    }
                    _ => value,
                };
                ((*name).to_owned(), value)
            });
            serde_json::Value::Object(pairs.collect())
        };
        lines.map(|line| serde_json::from_value(object(line)).expect("a row")).collect()
    }

    #[test]
    fn contacts_stand_at_their_instants() {
        let rows = [row(0.0, 7.0), row(0.2, 8.0), row(0.2, 9.0)];
        let found = SceneContacts::new(&[0.0, 0.1, 0.2], &rows);
        assert_eq!(found.starts, [0, 1, 1, 3]);
        let expected = [7.0, 8.0, 9.0].map(|normal| [1.0, 2.0, 3.0, 4.0, 5.0, 6.0 + normal, 1.0]);
        assert_eq!(found.values, encoded(expected.into_iter().flatten()));
        assert!(SceneContacts::new(&[0.0], &[]).starts.is_empty());
    }
}
