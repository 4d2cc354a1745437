//! A mission as data for a page: per element a flat list of its values and the windows from which they apply,
//! so that any window is found by one search.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Serialize, Serializer};

use crate::base::runs::Runs;
use crate::base::words;
use crate::draw::paint::classes::ElementLook;
use crate::evidence::Confidence;
use crate::graph::State;
use crate::view::{Arrow, Mark, Shown, ShownRuns, TopicRow, View};

/// The values of one item or arrow over the windows (indices into [`View::frames`]); before its first run a list has
/// value 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ElementRuns {
    /// Its class words: indices into [`ViewRuns::classes`].
    pub classes: Runs<u32>,
    /// Its rate: indices into [`ViewRuns::labels`]. While it is absent, the last value stays.
    pub rates: Runs<u32>,
    /// Its lifecycle state: indices into [`ViewRuns::labels`]. While it is absent, the last value stays.
    pub lifecycles: Runs<u32>,
    /// Windows in which its rate changed, each with the old and the new rate: indices into [`ViewRuns::labels`].
    /// Such a value applies to one window.
    pub turns: Runs<u32>,
    /// Its messages per second in each window, as decimal numbers: indices into [`ViewRuns::labels`]. While it is absent,
    /// the last value stays.
    pub hertz: Runs<u32>,
}

/// The whole sequence of a view as runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ViewRuns {
    /// Class words separated by blanks, such as `active`, `active stated added w3`; the first is `off`:
    /// absent.
    pub classes: Vec<String>,
    /// Rates and lifecycle states as they are written, and rates as numbers; the first is empty: unknown.
    pub labels: Vec<String>,
    /// The values of each item of the view.
    pub items: Vec<ElementRuns>,
    /// The values of each arrow of the view.
    pub arrows: Vec<ElementRuns>,
}

impl ViewRuns {
    /// The runs of a view. `label` writes the rate of an element in a window, and the topics that an arrow carries;
    /// empty for none.
    pub(crate) fn of(view: &View, label: impl Fn(&Shown, Option<&Arrow>) -> String) -> Self {
        let mut classes = ValueTable::starting_with(None);
        let mut labels = ValueTable::starting_with(String::new());
        let mut runs = |all: &[ShownRuns], arrows| {
            let mut recorder = RunRecorder {
                classes: &mut classes,
                labels: &mut labels,
                label: &label,
                arrows,
            };
            let runs = all.iter().map(|looks| recorder.runs(looks));
            runs.collect::<Vec<_>>()
        };
        let items = runs(&view.items_shown, None);
        let arrows = runs(&view.arrows_shown, Some(&view.arrows));
        Self {
            classes: classes.list(|class| class.map_or("off".to_owned(), LookClass::words)),
            labels: labels.list(Clone::clone),
            items,
            arrows,
        }
    }

    /// The look of an element in a window.
    pub(crate) fn look(&self, life: &ElementRuns, window: u32) -> ElementLook<'_> {
        let lists = [&life.lifecycles, &life.rates];
        let list = lists[usize::from(lists[0].0.is_empty())];
        ElementLook {
            class: &self.classes[life.classes.at(window).unwrap_or(0) as usize],
            text: &self.labels[list.at(window).unwrap_or(0) as usize],
        }
    }

    /// All class words that occur.
    pub(crate) fn words(&self) -> BTreeSet<&str> {
        self.classes
            .iter()
            .flat_map(|class| class.split(' '))
            .collect()
    }
}

/// The properties that decide the look of an element in a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct LookClass {
    state: State,
    confidence: Confidence,
    mark: Option<Mark>,
    /// Whether the receiver gets nothing.
    is_starved: bool,
    /// The step of an arrow's thickness, 0..=[`STEPS`](crate::view::STEPS); 0 for items.
    step: u8,
}

impl LookClass {
    fn of(shown: &Shown, arrow: Option<&Arrow>) -> Self {
        Self {
            state: shown.state,
            confidence: shown.confidence,
            mark: shown.mark,
            is_starved: shown.is_starved,
            step: arrow.map_or(0, |_| shown.width_step()),
        }
    }

    fn words(self) -> String {
        let mut words = vec![self.state.word().to_owned()];
        if self.confidence != Confidence::Measured {
            words.push(self.confidence.word().to_owned());
        }
        if let Some(mark) = self.mark {
            words.push(mark.class().to_owned());
            words.extend((mark.class() == "changed").then(|| mark.badge().to_owned()));
        }
        if self.is_starved {
            words.push("starved".to_owned());
        }
        if self.step > 0 {
            words.push(format!("w{}", self.step));
        }
        words.join(" ")
    }
}

/// Distinct values in order of appearance.
#[derive(Default)]
pub(super) struct ValueTable<T> {
    places: BTreeMap<T, u32>,
}

impl<T: Ord + Clone> ValueTable<T> {
    fn starting_with(first: T) -> Self {
        Self {
            places: BTreeMap::from([(first, 0)]),
        }
    }

    pub(super) fn place(&mut self, value: T) -> u32 {
        let next = u32::try_from(self.places.len()).unwrap_or(u32::MAX);
        *self.places.entry(value).or_insert(next)
    }

    pub(super) fn list(&self, write: impl Fn(&T) -> String) -> Vec<String> {
        let mut out = vec![String::new(); self.places.len()];
        for (value, place) in &self.places {
            out[*place as usize] = write(value);
        }
        out
    }
}

/// A writer of the values of the items, or of the arrows.
struct RunRecorder<'a, F> {
    classes: &'a mut ValueTable<Option<LookClass>>,
    labels: &'a mut ValueTable<String>,
    label: F,
    arrows: Option<&'a [Arrow]>,
}

impl<F: Fn(&Shown, Option<&Arrow>) -> String> RunRecorder<'_, F> {
    fn runs(&mut self, looks: &ShownRuns) -> ElementRuns {
        let mut life = ElementRuns::default();
        // The text of each rate is cached: formatting takes time, and most rates recur.
        let mut known: BTreeMap<_, u32> = BTreeMap::new();
        let mut numbers: BTreeMap<_, u32> = BTreeMap::new();
        let mut last_hz = None;
        for (window, shown) in looks.runs() {
            let Some(shown) = shown else {
                life.classes.push(window, 0, 0);
                continue;
            };
            let arrow = self.arrows.and_then(|all| all.get(shown.id as usize));
            let class = self.classes.place(Some(LookClass::of(shown, arrow)));
            life.classes.push(window, class, 0);
            let each = shown.hz.map(|hz| hz / shown.each.max(1) as f64);
            let number = *numbers.entry(each.map(f64::to_bits)).or_insert_with(|| {
                let text = each.map(|hz| words::significant(hz, 6).to_string());
                self.labels.place(text.unwrap_or_default())
            });
            life.hertz.push(window, number, 0);
            if shown.mark == Some(Mark::Removed) {
                continue;
            }
            let (hz, count) = shown.written_rate();
            let hz = (hz.is_some() || count.is_some_and(|n| n > 0)).then(|| {
                let rows: Vec<_> = shown.topics.iter().map(TopicRow::key).collect();
                (hz.map(f64::to_bits), count, shown.each, rows)
            });
            if hz != last_hz || (life.rates.0.is_empty() && arrow.is_some()) {
                last_hz.clone_from(&hz);
                let place = known.entry(hz).or_insert_with(|| {
                    let text = (self.label)(shown, arrow);
                    self.labels.place(text)
                });
                life.rates.push(window, *place, 0);
            }
            if shown.has_new_rate() {
                let value = self.labels.place(words::rates(&shown.steps));
                life.turns.0.push((window, value));
            }
            let members = shown
                .members
                .number()
                .map(|(n, word)| words::count(n, word));
            let lifecycle = shown.lifecycle.as_deref().or(members.as_deref());
            let lifecycle = lifecycle.unwrap_or_default();
            if !lifecycle.is_empty() || !life.lifecycles.0.is_empty() {
                let place = self.labels.place(lifecycle.to_owned());
                life.lifecycles.push(window, place, 0);
            }
        }
        life
    }
}

impl Serialize for ElementRuns {
    /// `[classes, rates, lifecycles, turns, hertz]`, each [flat](Runs::flat); empty lists at the end are left out.
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let lists = [
            &self.classes,
            &self.rates,
            &self.lifecycles,
            &self.turns,
            &self.hertz,
        ];
        let reported = lists.iter().rposition(|list| !list.0.is_empty());
        let lists = &lists[..reported.map_or(0, |last| last + 1)];
        let all: Vec<Vec<u32>> = lists.iter().map(|list| list.flat()).collect();
        all.serialize(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::ById;
    use crate::view::{ArrowKind, ItemId};

    /// One element over the windows: present with this mark and rate, or absent.
    type Story<'a> = &'a [Option<(Option<Mark>, f64)>];

    fn runs(story: Story<'_>) -> ViewRuns {
        let shown = |there: &Option<(Option<Mark>, f64)>| {
            there.map(|(mark, hz)| Shown {
                mark,
                hz: Some(hz),
                steady_hz: Some(hz),
                ..Shown::plain(0, State::Active, Confidence::Measured)
            })
        };
        let story: Vec<_> = story.iter().map(shown).collect();
        let view = View {
            arrows: ById::from(vec![Arrow {
                from: ItemId(0),
                to: ItemId(0),
                kind: ArrowKind::Publish,
                members: Vec::new(),
                topics: Vec::new(),
                is_service: false,
            }]),
            arrows_shown: vec![ShownRuns::of(story.iter().map(Option::as_ref))].into(),
            ..View::default()
        };
        ViewRuns::of(&view, |shown, _| format!("{:.0}", shown.hz.unwrap_or(0.0)))
    }

    fn reported(runs: &ViewRuns, windows: u32) -> Vec<(&str, &str)> {
        let life = &runs.arrows[0];
        let add = |w| {
            let class = &runs.classes[life.classes.at(w).unwrap_or(0) as usize];
            let label = &runs.labels[life.rates.at(w).unwrap_or(0) as usize];
            (class.as_str(), label.as_str())
        };
        (0..windows).map(add).collect()
    }

    #[test]
    fn every_window_can_be_looked_up() {
        let added = Some((Some(Mark::Added), 10.0));
        let removed = Some((Some(Mark::Removed), 0.0));
        let runs = runs(&[
            None,
            added,
            Some((None, 10.0)),
            Some((None, 0.0)),
            removed,
            None,
        ]);
        let expected = [
            ("off", ""),
            ("active added w2", "10"),
            ("active w2", "10"),
            ("active", "0"),
            ("active removed", "0"),
            ("off", "0"),
        ];
        assert_eq!(reported(&runs, 6), expected);
    }

    #[test]
    fn constant_states_are_one_run() {
        let runs = runs(&[Some((None, 9.8)); 50]);
        assert_eq!(
            serde_json::to_string(&runs.arrows).unwrap(),
            "[[[0,1],[0,2],[],[],[0,1]]]"
        );
        assert_eq!(reported(&runs, 50)[49], ("active w2", "10"));
    }

    #[test]
    fn equal_rates_may_be_written_differently() {
        let shown = |held: Option<f64>| Shown {
            hz: Some(0.0),
            held: held.map(|hz| (hz, None)),
            ..Shown::plain(0, State::Active, Confidence::Measured)
        };
        let story = [shown(Some(7.1)), shown(None), shown(Some(7.1))];
        let view = View {
            items_shown: vec![ShownRuns::of(story.iter().map(Some))].into(),
            ..View::default()
        };
        let label = |shown: &Shown, _: Option<&Arrow>| {
            format!("{:.1}", shown.written_rate().0.unwrap_or(0.0))
        };
        let runs = ViewRuns::of(&view, label);
        let text = |list: &Runs<u32>, w| &*runs.labels[list.at(w).unwrap_or(0) as usize];
        let [item] = &runs.items[..] else { panic!() };
        assert_eq!(
            [0, 1, 2].map(|w| text(&item.rates, w)),
            ["7.1", "0.0", "7.1"]
        );
        assert_eq!([0, 1, 2].map(|w| text(&item.hertz, w)), ["0", "0", "0"]);
    }
}
