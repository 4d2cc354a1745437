use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::Value;

use super::*;
use crate::evidence::Degree;
use crate::graph::{Element, State};
use crate::time::{Span, Stamp};
use crate::view::{Arrow, ItemKind, Tally};

/// The view of an evolution in JSON with nothing filtered: a window per window, a box per element.
fn view_of(json: &Value) -> View {
    let windows = json["windows"].as_array().unwrap();
    let mut items: BTreeMap<(bool, String), u32> = BTreeMap::new();
    let mut arrows: BTreeMap<(u32, u32, bool), u32> = BTreeMap::new();
    let list = |w: &Value, key: &str| w[key].as_array().cloned().unwrap_or_default();
    let text = |v: &Value, key: &str| v[key].as_str().unwrap().to_owned();
    for w in windows {
        for (key, is_topic) in [("nodes", false), ("topics", true)] {
            for e in list(w, key) {
                items.insert((is_topic, text(&e, "name")), 0);
            }
        }
    }
    for (id, value) in items.values_mut().enumerate() {
        *value = id as u32;
    }
    let ends = |e: &Value, subscribes: bool| {
        let node = items[&(false, text(e, "node"))];
        let topic = items[&(true, text(e, "topic"))];
        if subscribes {
            (topic, node, true)
        } else {
            (node, topic, false)
        }
    };
    for w in windows {
        for (key, subscribes) in [("publishes", false), ("subscribes", true)] {
            for e in list(w, key) {
                arrows.insert(ends(&e, subscribes), 0);
            }
        }
    }
    for (id, value) in arrows.values_mut().enumerate() {
        *value = id as u32;
    }
    let shown = |id: u32, e: &Value| Shown {
        id,
        state: State::ALL
            .into_iter()
            .find(|s| Some(s.word()) == e["state"].as_str())
            .unwrap_or(State::Active),
        degree: Degree::ALL
            .into_iter()
            .find(|d| Some(d.word()) == e["degree"].as_str())
            .unwrap_or(Degree::Measured),
        mark: None,
        hz: e["hz"].as_f64(),
        from_hz: None,
        count: e["count"].as_u64(),
        lifecycle: e["lifecycle"].as_str().map(Arc::from),
    };
    let mut frames: Vec<Frame> = Vec::new();
    for w in windows {
        let mut now: [Vec<Shown>; 2] = [Vec::new(), Vec::new()];
        for (key, is_topic) in [("nodes", false), ("topics", true)] {
            now[0].extend(
                list(w, key)
                    .iter()
                    .map(|e| shown(items[&(is_topic, text(e, "name"))], e)),
            );
        }
        for (key, subscribes) in [("publishes", false), ("subscribes", true)] {
            now[1].extend(
                list(w, key)
                    .iter()
                    .map(|e| shown(arrows[&ends(e, subscribes)], e)),
            );
        }
        let mut tally = Tally::default();
        let mut caption = Vec::new();
        if let Some(last) = frames.last() {
            for (kind, before) in [&last.items, &last.arrows].into_iter().enumerate() {
                mark(&mut now[kind], before);
            }
        }
        now.iter_mut().for_each(|list| list.sort_by_key(|s| s.id));
        let names: BTreeMap<u32, &(bool, String)> = items.iter().map(|(k, v)| (*v, k)).collect();
        for s in &now[0] {
            let (is_topic, name) = names[&s.id];
            match (s.mark, is_topic) {
                (Some(Mark::Added), false) => tally.nodes_added += 1,
                (Some(Mark::Added), true) => tally.topics_added += 1,
                (Some(Mark::Removed), false) => tally.nodes_removed += 1,
                (Some(Mark::Removed), true) => tally.topics_removed += 1,
                (Some(Mark::Faster | Mark::Slower), _) => tally.rates += 1,
                _ => {}
            }
            let verb = match s.mark {
                Some(Mark::Added) => "appeared".to_owned(),
                Some(Mark::Removed) => "vanished".to_owned(),
                Some(Mark::Faster | Mark::Slower) if *is_topic => {
                    words::hz_change(s.from_hz.unwrap(), s.hz.unwrap())
                }
                _ => continue,
            };
            caption.push(format!("{name} {verb}"));
        }
        let [items, arrows] = now;
        frames.push(Frame {
            index: frames.len(),
            span: Span {
                start: Stamp(w["start_ns"].as_i64().unwrap()),
                end: Stamp(w["end_ns"].as_i64().unwrap()),
            },
            partial: w["partial"].as_bool().unwrap_or(false),
            messages: w["messages"].as_u64().unwrap_or(0),
            items,
            arrows,
            tally,
            caption,
        });
    }
    let kind = |is_topic: bool| {
        if is_topic {
            ItemKind::Topic
        } else {
            ItemKind::Node
        }
    };
    View {
        items: items
            .iter()
            .map(|((is_topic, name), id)| Item {
                kind: kind(*is_topic),
                name: Arc::from(name.as_str()),
                members: vec![if *is_topic {
                    Element::Topic(*id)
                } else {
                    Element::Node(*id)
                }],
            })
            .collect(),
        arrows: arrows
            .iter()
            .map(|((from, to, subscribes), _)| Arrow {
                from: *from,
                to: *to,
                kind: if *subscribes {
                    ArrowKind::Subscribe
                } else {
                    ArrowKind::Publish
                },
                members: Vec::new(),
            })
            .collect(),
        frames,
    }
}

/// Marks what came, went and changed its rate since `before`.
fn mark(now: &mut Vec<Shown>, before: &[Shown]) {
    let old: BTreeMap<u32, &Shown> = before
        .iter()
        .filter(|s| s.mark != Some(Mark::Removed))
        .map(|s| (s.id, s))
        .collect();
    for s in now.iter_mut() {
        match old.get(&s.id) {
            None => s.mark = Some(Mark::Added),
            Some(b) => {
                if let (Some(a), Some(b)) = (b.hz, s.hz) {
                    if (a - b).abs() > 0.25 * a.max(b) {
                        s.mark = Some(if b > a { Mark::Faster } else { Mark::Slower });
                        s.from_hz = Some(a);
                    }
                }
            }
        }
    }
    let here: Vec<u32> = now.iter().map(|s| s.id).collect();
    for (id, s) in old {
        if !here.contains(&id) {
            now.push(Shown {
                mark: Some(Mark::Removed),
                hz: Some(0.0),
                ..s.clone()
            });
        }
    }
}

#[test]
#[ignore = "for looking at"]
fn dump() {
    let var = |key: &str, or: &str| std::env::var(key).unwrap_or_else(|_| or.to_owned());
    let json: Value = serde_json::from_slice(
        &std::fs::read(var("BAG", "../shared/data/graphs/medium.json")).unwrap(),
    )
    .unwrap();
    let view = view_of(&json);
    let fonts = Fonts::bundled();
    let style = Style::builtin(&var("STYLE", "light")).unwrap();
    let size = var("SIZE", "1280x720");
    let (w, h) = size.split_once('x').unwrap();
    let wish = Wish {
        size: Size::new(w.parse().unwrap(), h.parse().unwrap()),
        title: "medium.json".to_owned(),
        bare: var("BARE", "") == "1",
        ..Wish::default()
    };
    let t = std::time::Instant::now();
    let sketch = Sketch::new(&view, &style, &fonts, wish);
    let picture = sketch.laid_out(layout::engine("layered").unwrap());
    println!(
        "layout {:?} text {} px, orientation {:?}",
        t.elapsed(),
        picture.text_px(),
        picture.layout().orientation
    );
    let painter = crate::pixels::Painter::new(&fonts);
    for k in var("FRAMES", "0").split(',') {
        let (k, phase): (usize, f64) = match k.split_once('@') {
            Some((k, p)) => (k.parse().unwrap(), p.parse().unwrap()),
            None => (k.parse().unwrap(), 1.0),
        };
        let scene = picture.between(k, phase);
        std::fs::write(format!("/tmp/pic/out-{k}.svg"), crate::svg::write(&scene)).unwrap();
        let pixels = painter.paint(&scene, 1.0).unwrap();
        let mut ppm = format!(
            "P7\nWIDTH {}\nHEIGHT {}\nDEPTH 4\nMAXVAL 255\nTUPLTYPE RGB_ALPHA\nENDHDR\n",
            pixels.width, pixels.height
        )
        .into_bytes();
        ppm.extend(&pixels.rgba);
        std::fs::write(format!("/tmp/pic/out-{k}.pam"), ppm).unwrap();
    }
}
