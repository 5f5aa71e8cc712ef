//! Memory of columns that are no longer needed.

/// Memory of columns that are no longer needed, for the columns of the next log: to obtain memory
/// from the system can take longer than to read the log.
#[derive(Debug, Default)]
pub struct ColumnMemory {
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) times: Vec<Vec<i64>>,
    pub(crate) orders: Vec<Vec<u32>>,
}

/// Takes the smallest of the columns with at least this capacity, emptied.
pub(super) fn take<T>(spare: &mut Vec<Vec<T>>, capacity: usize) -> Option<Vec<T>> {
    let fits = |(_, column): &(usize, &Vec<T>)| column.capacity() >= capacity;
    let smallest = spare.iter().enumerate().filter(fits);
    let (place, _) = smallest.min_by_key(|(_, column)| column.capacity())?;
    let mut column = spare.swap_remove(place);
    column.clear();
    Some(column)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_column_that_is_large_enough_is_taken() {
        let mut spare: Vec<Vec<u8>> = [100, 10, 50].map(Vec::with_capacity).into();
        spare[2].push(7);
        let taken = take(&mut spare, 20).unwrap();
        assert_eq!((taken.len(), taken.capacity(), spare.len()), (0, 50, 2));
        assert!(take(&mut spare, 101).is_none());
        assert_eq!(spare.len(), 2);
    }
}
