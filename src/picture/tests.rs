use std::path::Path;

use super::*;
use crate::evolution::read_json;
use crate::view::{ViewOptions, view};

#[test]
#[ignore = "for looking at"]
fn dump() {
    let var = |key: &str, or: &str| std::env::var(key).unwrap_or_else(|_| or.to_owned());
    let path = var("BAG", "../shared/data/graphs/medium.json");
    let mut evolution =
        read_json(&std::fs::read_to_string(&path).unwrap(), Path::new(&path)).unwrap();
    evolution.find_changes(0.25, &[]);
    let (view, _) = view(&evolution, &ViewOptions::default());
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
    let mut layout = layout::lay_out(
        sketch.plan(),
        &sketch.layout_wish(),
        layout::engine("layered").unwrap(),
    );
    for (route, link) in layout.routes.iter_mut().zip(&sketch.plan().links) {
        if route.label.is_none() && link.label.is_some() && !route.curves.is_empty() {
            let c = route.curves[0];
            route.label = Some(crate::geometry::Point::new(
                (c[0].x + c[1].x) / 2.0,
                (c[0].y + c[1].y) / 2.0,
            ));
        }
    }
    let picture = sketch.with(layout);
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
