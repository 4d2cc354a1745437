use super::*;
use crate::view::testing::mission;
use crate::view::{ViewOptions, view};

#[test]
fn only_what_changed_and_its_neighbours_are_drawn() {
    let (view, _) = view(
        &mission(&["/a>/t@2 /x>/y@1", "/a>/t@2 /b</t /x>/y@1"]),
        &ViewOptions::default(),
    );
    let (seen, left_out) = chart::changed(&view).unwrap();
    let mut names: Vec<&str> = seen
        .items
        .iter()
        .map(|s| &*view.items[s.item()].name)
        .collect();
    names.sort_unstable();
    assert_eq!(
        (names, seen.arrows.len(), left_out),
        (vec!["/b", "/t"], 1, 0)
    );
}

#[test]
fn long_tables_state_what_is_left_out() {
    let rows = (0..100).map(|n| format!("| {n} |\n"));
    let text = table(&["N"], rows.collect(), 60).unwrap();
    assert!(
        text.len() < 120 && text.ends_with("rows more left out.\n"),
        "{text}"
    );
}
