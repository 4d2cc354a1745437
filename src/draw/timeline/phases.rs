//! The phases of the mission: their names in the band above rows, and their titles below a figure.

use super::canvas::{PaperCanvas, Type, ink};
use super::notes::{TextRun, Unbroken, flow};
use super::source::FigureSource;
use crate::base::time::Span;
use crate::mission::event_log::Phase;

/// A phase in the band.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhaseLabel {
    pub(crate) span: Span,
    /// Its names, the best first, the shortest last.
    pub(crate) names: Vec<String>,
}

/// The phases by their numbers, which a figure explains below.
pub(crate) fn numbered(source: &FigureSource<'_>) -> Vec<PhaseLabel> {
    let label = |(k, phase): (usize, &Phase)| PhaseLabel {
        span: phase.span,
        names: vec![(k + 1).to_string()],
    };
    source.phases.iter().enumerate().map(label).collect()
}

/// The phases with their names: the user's, else the elements that begin, else those that end, each name with as many of
/// them as fit. A phase with the same nodes as the previous one is merged with it.
pub(crate) fn named(source: &FigureSource<'_>) -> Vec<PhaseLabel> {
    let mut phases: Vec<PhaseLabel> = Vec::new();
    for (k, phase) in source.phases.iter().enumerate() {
        if let Some(last) = phases.last_mut()
            && !source.is_named
            && counts(k, phase).is_empty()
        {
            last.span.end = phase.span.end;
            continue;
        }
        let names = match phase.name.split_once(": ").filter(|_| !source.is_named) {
            Some((count, those)) => {
                let sign: String = count.chars().take(1).collect();
                shorter(&sign, those, phase.nodes_added.max(phase.nodes_removed))
            }
            None if k == 0 && !source.is_named => {
                let names = [&*phase.name, "start"].map(str::to_owned);
                names[usize::from(phase.nodes_added == 0)..].to_vec()
            }
            None => vec![phase.name.to_string()],
        };
        phases.push(PhaseLabel {
            span: phase.span,
            names,
        });
    }
    phases
}

/// The numbers of elements that a phase adds and removes, `+4 −1`; none in the first.
fn counts(k: usize, phase: &Phase) -> String {
    let counts = [('+', phase.nodes_added), ('−', phase.nodes_removed)];
    let counts = counts.iter().filter(|(_, many)| *many > 0 && k > 0);
    let counts: Vec<String> = counts.map(|(sign, n)| format!("{sign}{n}")).collect();
    counts.join(" ")
}

/// The elements that began or ended, in fewer and fewer words: all that the phase names, two and one of them with the
/// number of the others, the shortest of them.
fn shorter(sign: &str, those: &str, all: u32) -> Vec<String> {
    let mut names = vec![format!("{sign} {those}")];
    let (first, last) = those.rsplit_once(" and ").unwrap_or((those, ""));
    let last = Some(last).filter(|last| !last.is_empty() && !last.ends_with(" more"));
    let each: Vec<&str> = first.split(", ").chain(last).collect();
    for most in [2, 1] {
        let rest = (all as usize).saturating_sub(most);
        if each.len() > most && rest > 0 {
            names.push(format!("{sign} {}, +{rest}", each[..most].join(", ")));
        }
    }
    let short = each.iter().min_by_key(|name| name.chars().count());
    names.extend(short.map(|name| format!("{sign} {name}")));
    names
}

/// The title of a phase in a figure: `navigation (+4)`, `picking (+4 −4)`, `boot (11)`, `row (=)`, `(+2) as 3`.
pub(crate) fn title(source: &FigureSource<'_>, k: usize) -> String {
    let Some(phase) = source.phases.get(k) else {
        return String::new();
    };
    let counts = match counts(k, phase) {
        _ if k == 0 => phase.nodes_added.to_string(),
        none if none.is_empty() => "=".to_owned(),
        counts => counts,
    };
    let is_said = source.is_named || phase.is_ramp;
    let name = is_said.then(|| format!("{} ", phase.name));
    let again = phase.same_as.map(|k| format!(" as {}", k + 1));
    [name, Some(format!("({counts})")), again]
        .into_iter()
        .flatten()
        .collect()
}

/// Draws the titles of the phases as running text from `y` on; returns the y at which they end.
pub(crate) fn names(
    canvas: &mut PaperCanvas<'_>,
    source: &FigureSource<'_>,
    width: f64,
    y: f64,
) -> f64 {
    let item = |k: usize| {
        vec![
            TextRun::Words(Type::Strong, ink::TEXT, format!("{} ", k + 1)),
            TextRun::Words(Type::Small, ink::TEXT, title(source, k)),
        ]
    };
    let items: Vec<Unbroken> = (0..source.phases.len()).map(item).collect();
    flow(canvas, width, y, &items)
}
