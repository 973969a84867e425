//! Sinks: where the samples of a motion go.

/// Receives the samples of a run, one after the other.
///
/// The type `S` of a sample is chosen by the room that makes it.
pub trait Sink<S> {
    /// What can go wrong while writing.
    type Error;
    /// Takes one sample.
    ///
    /// # Errors
    /// Whatever the sink cannot do; the run stops then.
    fn record(&mut self, sample: &S) -> Result<(), Self::Error>;
}

/// Keeps every sample in memory.
impl<S: Clone> Sink<S> for Vec<S> {
    type Error = std::convert::Infallible;
    fn record(&mut self, sample: &S) -> Result<(), Self::Error> {
        self.push(sample.clone());
        Ok(())
    }
}

/// Calls a function for every sample.
pub struct Each<F>(pub F);

impl<S, E, F: FnMut(&S) -> Result<(), E>> Sink<S> for Each<F> {
    type Error = E;
    fn record(&mut self, sample: &S) -> Result<(), E> {
        (self.0)(sample)
    }
}
