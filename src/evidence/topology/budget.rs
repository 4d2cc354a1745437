//! The work that a launch file may ask for: files include each other, texts repeat each other, and neither may run away.

use crate::base::budget::LAUNCH_WORK;

/// What is left of the work; told once when it is used up.
#[derive(Debug)]
pub(super) struct Budget {
    left: usize,
    /// Whether something was refused.
    pub(super) is_spent: bool,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            left: LAUNCH_WORK,
            is_spent: false,
        }
    }
}

impl Budget {
    /// The budget for what one text of this many bytes says by itself, without other files: loops over long lists need
    /// a tenth of it.
    pub(super) fn of_text(bytes: usize) -> Self {
        Self {
            left: LAUNCH_WORK.min((1 << 20) + bytes.saturating_mul(500)),
            is_spent: false,
        }
    }

    /// Takes `work` from it; `None` if not as much is left.
    pub(super) fn spend(&mut self, work: usize) -> Option<()> {
        match self.left.checked_sub(work) {
            Some(left) if !self.is_spent => {
                self.left = left;
                Some(())
            }
            _ => {
                self.is_spent = true;
                None
            }
        }
    }
}
