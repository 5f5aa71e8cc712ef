//! Chooses the size of the pages by what they cost on this machine now.
//!
//! On most machines one huge page costs a tenth of the normal pages it replaces. In a virtual machine
//! whose host takes back free memory, huge pages come from the host again, and normal ones, which the
//! system has used before, are several times cheaper.

/// The size of the pages of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PageSize {
    Huge,
    Normal,
}

/// What pages of either size cost so far.
#[derive(Debug)]
pub(super) struct PageSizes {
    huge_ns: Option<u64>,
    normal_ns: Option<u64>,
    steps: u32,
    /// The step at which the dearer size is tried again.
    next_trial: u32,
}

impl Default for PageSizes {
    fn default() -> Self {
        Self {
            huge_ns: None,
            normal_ns: None,
            steps: 0,
            next_trial: 16,
        }
    }
}

impl PageSizes {
    /// The cheaper size; from time to time, ever more rarely, the other one.
    pub(super) fn choose(&mut self) -> PageSize {
        self.steps += 1;
        let (Some(huge), Some(normal)) = (self.huge_ns, self.normal_ns) else {
            return match self.huge_ns {
                None => PageSize::Huge,
                Some(_) => PageSize::Normal,
            };
        };
        let is_trial = self.steps >= self.next_trial;
        if is_trial {
            self.next_trial = self.steps.saturating_mul(2);
        }
        match (huge <= normal) != is_trial {
            true => PageSize::Huge,
            false => PageSize::Normal,
        }
    }

    /// Takes in the cost of a step (ns), half of which counts at once.
    pub(super) fn learn(&mut self, size: PageSize, cost_ns: u64) {
        let known = match size {
            PageSize::Huge => &mut self.huge_ns,
            PageSize::Normal => &mut self.normal_ns,
        };
        *known = Some(known.map_or(cost_ns, |known| known / 2 + cost_ns / 2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count_of_huge(costs: impl Fn(u32, PageSize) -> u64) -> u32 {
        let mut sizes = PageSizes::default();
        let mut count = 0;
        for step in 0..1000 {
            let size = sizes.choose();
            count += u32::from(size == PageSize::Huge);
            sizes.learn(size, costs(step, size));
        }
        count
    }

    #[test]
    fn the_cheaper_size_is_used_and_the_other_one_tried_rarely() {
        let cheap = |wanted| move |_, size| if size == wanted { 100 } else { 1000 };
        assert!(count_of_huge(cheap(PageSize::Huge)) > 985);
        assert!(count_of_huge(cheap(PageSize::Normal)) < 15);
    }

    #[test]
    fn a_change_of_the_costs_is_noticed() {
        let changing = |step, size| match (step < 100, size) {
            (true, PageSize::Huge) | (false, PageSize::Normal) => 100,
            _ => 1000,
        };
        let count = count_of_huge(changing);
        assert!((95..140).contains(&count), "{count}");
    }
}
