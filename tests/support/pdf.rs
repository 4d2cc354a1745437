//! Font sizes of a PDF on paper, from its content streams.

use std::io::Read as _;

/// The size in points of every text run on every page, including scaling.
pub fn letters_pt(pdf: &[u8]) -> Vec<f64> {
    let mut all = Vec::new();
    let mut rest = pdf;
    while let Some(at) = find(rest, b"stream\n") {
        let body = &rest[at + b"stream\n".len()..];
        let end = find(body, b"endstream").unwrap_or(body.len());
        let mut content = Vec::new();
        let unpacked = flate2::read::ZlibDecoder::new(&body[..end]).read_to_end(&mut content);
        if unpacked.is_ok() && find(&content, b" Tf").is_some() {
            all.extend(of_content(&content));
        }
        rest = &body[end + b"endstream".len()..];
    }
    all
}

fn find(text: &[u8], word: &[u8]) -> Option<usize> {
    text.windows(word.len()).position(|w| w == word)
}

/// The tokens of a content stream, without the contents of strings.
fn tokens(content: &[u8]) -> Vec<String> {
    let mut all = vec![String::new()];
    let (mut depth, mut escaped) = (0, false);
    for byte in content {
        match (byte, depth) {
            _ if escaped => escaped = false,
            (b'\\', 1..) => escaped = true,
            (b'(', _) => depth += 1,
            (b')', 1..) => depth -= 1,
            (_, 1..) => {}
            (b' ' | b'\n' | b'\r' | b'\t' | b'[' | b']', _) => all.push(String::new()),
            (b'/', _) => all.push("/".to_owned()),
            (byte, _) => {
                if let Some(last) = all.last_mut() {
                    last.push(char::from(*byte));
                }
            }
        }
    }
    all.retain(|token| !token.is_empty());
    all
}

/// The height of one unit after a matrix `a b c d e f`.
fn tall(matrix: &[f64]) -> f64 {
    matrix[2].hypot(matrix[3])
}

fn of_content(content: &[u8]) -> Vec<f64> {
    let (mut all, mut numbers) = (Vec::new(), Vec::new());
    // The height of a unit on the page, and the heights that `Q` restores; our drawings never rotate text.
    let (mut page, mut kept) = (1.0, Vec::new());
    let (mut size, mut line) = (0.0, 1.0);
    for token in tokens(content) {
        if let Ok(number) = token.parse::<f64>() {
            numbers.push(number);
            continue;
        }
        let own = |many: usize| &numbers[numbers.len() - many..];
        match token.as_str() {
            "q" => kept.push(page),
            "Q" => page = kept.pop().unwrap(),
            "cm" => page *= tall(own(6)),
            "BT" => line = 1.0,
            "Tf" => size = own(1)[0],
            "Tm" => line = tall(own(6)),
            "Tj" | "TJ" => all.push(size * line * page),
            _ => {}
        }
        if !token.starts_with('/') {
            numbers.clear();
        }
    }
    all
}
