//! Values that many results have in common, held once.

use std::collections::HashSet;
use std::hash::Hash;
use std::ops::Deref;
use std::sync::{Arc, Mutex};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::lock::lock;

/// A value of which equal ones may be one in memory. It is written and read like the value itself.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shared<T: ?Sized>(Arc<T>);

impl<T: ?Sized> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: ?Sized> Deref for Shared<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: ?Sized, V> From<V> for Shared<T>
where
    Arc<T>: From<V>,
{
    fn from(value: V) -> Self {
        Self(value.into())
    }
}

impl<T: Serialize + ?Sized> Serialize for Shared<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de, T: ?Sized> Deserialize<'de> for Shared<T>
where
    Box<T>: Deserialize<'de>,
{
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Box::deserialize(deserializer).map(Self::from)
    }
}

/// The different values that were seen.
#[derive(Debug)]
pub(crate) struct Pool<T: ?Sized>(Mutex<HashSet<Arc<T>>>);

impl<T: ?Sized> Default for Pool<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Eq + Hash + ?Sized> Pool<T> {
    /// Makes a value one with the first equal one.
    pub(crate) fn share(&self, value: &mut Shared<T>) {
        let mut known = lock(&self.0);
        match known.get(&**value) {
            Some(first) => value.0 = Arc::clone(first),
            None => {
                known.insert(Arc::clone(&value.0));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_become_one_and_are_written_as_before() {
        let text = r#"["lift","slew","lift"]"#;
        let mut names: Vec<Shared<str>> = serde_json::from_str(text).unwrap();
        let is_one = |a: &Shared<str>, b: &Shared<str>| Arc::ptr_eq(&a.0, &b.0);
        assert!(!is_one(&names[0], &names[2]));
        let pool = Pool::default();
        names.iter_mut().for_each(|name| pool.share(name));
        assert!(is_one(&names[0], &names[2]));
        assert!(!is_one(&names[0], &names[1]));
        assert_eq!(serde_json::to_string(&names).unwrap(), text);
    }
}
