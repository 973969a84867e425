//! What happens at nodes: values that are sampled, kept and held, in the order of dependence.

use super::sampler::{Due, Gains, SamplerTask};
use super::{NumberSource, Terms, key, label, output};
use holonom_model::ModelError;
use vi_multibody::builder::Read;

impl<'a> Terms<'a> {
    /// What happens at nodes, in the order of dependence.
    pub(super) fn tasks(&mut self) -> Result<Vec<Due>, ModelError> {
        let (model, mut all) = (self.names.model, Vec::new());
        let step = model.settings.step;
        for signal in &model.signals {
            let (place, name) = (self.place(signal), signal.name.as_str());
            if let Some(past) = self.pasts.get(name).copied() {
                let of = self.stated(signal, "of")?;
                all.push((place, of, None, Due { every: 1, task: SamplerTask::Keep { past, of } }));
            }
            let Some(period) = signal.every else { continue };
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // checked: positive
            let every = (period / step).round() as u64;
            if let Some(value) = &signal.value {
                let own = [("t", NumberSource::Input(0)), ("last", self.held(place, name))];
                let key = key(name, "value");
                let of = self.formula(&label(name), &key, value, &own)?;
                let task = SamplerTask::Value { held: place, of };
                all.push((place, of, None, Due { every, task }));
            } else if let Some(pid) = &signal.pid {
                let error = self.stated(signal, "of")?;
                let ahead = pid.feedforward.is_some();
                let feedforward =
                    if ahead { Some(self.stated(signal, "feedforward")?) } else { None };
                let gains = Gains::of(pid, &mut |_, value| value);
                let task = SamplerTask::Pid { held: place, error, feedforward, gains, period };
                all.push((place, error, feedforward, Due { every, task }));
                for (part, k) in [("i", 1), ("d", 2)] {
                    let source = self.held(place + k, &format!("{name}.{part}"));
                    self.output.push(output::OutputNumber::new(name, part, source));
                }
                self.output.push(output::OutputNumber::new(name, "e", error));
            }
        }
        let mut places = Vec::new();
        let mut sorted = Vec::new();
        for k in 0..all.len() {
            self.visit(k, &all, &mut places, &mut sorted);
        }
        Ok(sorted)
    }

    /// Adds a task after those whose held values it reads, but for circles.
    pub(super) fn visit(
        &self,
        k: usize,
        all: &[(usize, NumberSource, Option<NumberSource>, Due)],
        visited: &mut Vec<usize>,
        sorted: &mut Vec<Due>,
    ) {
        if visited.contains(&k) {
            return;
        }
        visited.push(k);
        let (_, of, ahead, due) = all[k];
        let (_, inputs, _) =
            self.reached(&[Some(of), ahead].into_iter().flatten().collect::<Vec<_>>());
        for input in inputs {
            if let (Read::Held(place), _) = self.inputs[input]
                && let Some(other) = all.iter().position(|(own, ..)| *own == place)
            {
                self.visit(other, all, visited, sorted);
            }
        }
        sorted.push(due);
    }
}
