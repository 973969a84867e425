//! Frames of bushings by a parameter.

use super::{LEAVE_OUT, ModelTangent, NumberChain, eps, refused};
use holonom_model::ModelError;
use std::sync::Arc;
use vi_multibody::builder::ElementForce;
use vi_multibody::design::{FrameChange, MovedFrames, MovedSixForce, MovedSixSpring};
use vi_multibody::joint::FrameId;

impl NumberChain<'_> {
    /// Places and orientations of bushings, and what these are stated in.
    pub(super) fn bushing_frames(&self, found: &mut ModelTangent) -> Result<(), ModelError> {
        let forces = &self.system.dynamics.forces;
        for own in &self.stated.bushings {
            let Some(coordinates) = forces.bushing_coordinates(&own.name) else { continue };
            let (point, axes) = self.placements.bushing(own);
            let change = |member: &String| {
                let frame = self.model.frame(member).map_or(FrameId::Ground, FrameId::Frame);
                let side = self.side(frame, &point, &axes);
                FrameChange { point: eps(&side.anchor), axes: side.axes.map(|x| x.eps) }
            };
            let changes = [change(&own.from), change(&own.to)];
            let Some(frames) = MovedFrames::of(coordinates, changes) else { continue };
            for spring in forces.bushings.iter().filter(|spring| spring.name == own.name) {
                let moved = MovedSixSpring::new(spring.spring.clone(), frames.clone());
                found.numbers.energies.push(Arc::new(moved));
            }
            for force in forces.forces.iter().filter(|force| force.name == own.name) {
                let ElementForce::Six(six) = &force.force else { continue };
                let moved = MovedSixForce::new(six.clone(), frames.clone()).ok_or_else(|| {
                    let name = &found.name;
                    let what = format!(
                        "the derivative by `{name}`, which moves the frames of a bushing whose expressions read \
                         more than its own coordinates"
                    );
                    refused(&format!("bushing.{}", own.name), what, LEAVE_OUT)
                })?;
                found.numbers.forces.push((own.name.clone(), Arc::new(moved)));
            }
            found.bushings.push((own.name.clone(), frames));
        }
        Ok(())
    }
}
