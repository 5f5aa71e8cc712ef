//! Circles in who uses whom.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// The nodes that each node uses.
pub(super) type Graph = BTreeMap<String, BTreeSet<String>>;

/// Returns, for each group of nodes that use each other, the shortest circle in it, and the size of the group.
pub(super) fn circles(graph: &Graph) -> Vec<(Vec<String>, usize)> {
    let reach: BTreeMap<&String, BTreeSet<String>> = graph
        .keys()
        .map(|node| (node, reachable(graph, node)))
        .collect();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for (node, from_here) in &reach {
        if seen.contains(*node) || !from_here.contains(*node) {
            continue;
        }
        let group: Vec<&String> = (from_here.iter())
            .filter(|other| {
                reach
                    .get(other)
                    .is_some_and(|theirs| theirs.contains(*node))
            })
            .collect();
        let circles = group
            .iter()
            .filter_map(|member| circle_through(graph, member));
        let shortest = circles.min_by_key(Vec::len).unwrap_or_default();
        found.push((shortest, group.len()));
        seen.extend(group.into_iter().cloned());
    }
    found
}

/// All that a node uses, directly or not; itself only where it is in a circle.
fn reachable(graph: &Graph, node: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut waiting = vec![node.to_string()];
    while let Some(next) = waiting.pop() {
        for used in graph.get(&next).into_iter().flatten() {
            if found.insert(used.clone()) {
                waiting.push(used.clone());
            }
        }
    }
    found
}

/// The shortest way from a node back to itself, by breadth-first search.
fn circle_through(graph: &Graph, node: &str) -> Option<Vec<String>> {
    let mut ways = VecDeque::from([vec![node.to_string()]]);
    let mut seen = BTreeSet::new();
    while let Some(way) = ways.pop_front() {
        for used in graph.get(way.last()?).into_iter().flatten() {
            if used == node {
                return Some(way);
            }
            if seen.insert(used.clone()) {
                ways.push_back([way.as_slice(), std::slice::from_ref(used)].concat());
            }
        }
    }
    None
}
