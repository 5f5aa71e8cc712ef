//! Parts of the passes over a whole log.

/// A part of a pass over a whole log, independent of the others that it is run with.
pub type Pass<'p> = Box<dyn FnOnce() + Send + 'p>;

/// Runs the parts that it is given, on one thread or on several.
pub(super) type Run<'r> = &'r (dyn Fn(Vec<Pass<'_>>) + Sync);
