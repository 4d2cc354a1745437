//! Suggestions for misspelled names: the nearest by edit distance.

/// The largest edit distance of a suggestion: names that differ in more mean something else.
const MOST: usize = 2;
/// The most characters of a name that are compared.
const LONGEST: usize = 200;

/// The known name nearest to `name`, the first of several; `None` if it is known itself or none is close.
pub(crate) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let apart = known.map(|other| (distance(name, other), other));
    let (distance, other) = apart.min()?;
    // In a short name, two letters are too many.
    let most = MOST.min(name.chars().count().div_ceil(3));
    (1..=most).contains(&distance).then_some(other)
}

/// The end of a sentence about an unknown name, which suggests the nearest; empty if none is close.
pub(crate) fn suggestion<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    nearest(name, known).map_or_else(String::new, |near| format!("; the nearest is `{near}`"))
}

/// The number of letters to insert, leave out or exchange (Levenshtein).
fn distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().take(LONGEST).collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (at, letter) in one.chars().take(LONGEST).enumerate() {
        let mut above = row[0];
        row[0] = at + 1;
        for (column, same) in other.iter().enumerate() {
            let exchanged = above + usize::from(*same != letter);
            above = row[column + 1];
            row[column + 1] = exchanged.min(above + 1).min(row[column] + 1);
        }
    }
    row[other.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typos_are_matched() {
        let known = ["/robot1/scan", "/robot1/odom", "/tf"];
        assert_eq!(
            nearest("/robot1/scna", known.into_iter()),
            Some("/robot1/scan")
        );
        assert_eq!(
            nearest("/robot1/odm", known.into_iter()),
            Some("/robot1/odom")
        );
        assert_eq!(nearest("/robot1/scan", known.into_iter()), None);
        assert_eq!(nearest("/camera", known.into_iter()), None);
        assert_eq!(nearest("/a", known.into_iter()), None);
        assert_eq!(nearest("/x", std::iter::empty()), None);
    }
}
