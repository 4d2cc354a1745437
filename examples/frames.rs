//! Draws the frames of a bag, one SVG file per window, and prints the number of files.
//!
//! `cargo run --release --example frames -- examples/warehouse.bag 'out/{n}.svg'`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use bagreel::{Output, Reading, Render, render};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let bag = arguments.next().ok_or("give a bag")?;
    let frames = arguments
        .next()
        .ok_or("give a name for the frames, such as `out/{n}.svg`")?;
    let reading = Reading::of([bag]);
    let job = Render::new(reading, vec![Output::parse(&frames, None)?])?;
    for written in render(&job)?.written {
        println!("{} files, {} bytes", written.files, written.bytes);
    }
    Ok(())
}
