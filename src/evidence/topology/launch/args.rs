//! The topics in the arguments of well-known programs: relays of `topic_tools`, `republish` of `image_transport`, and
//! the program that a nodelet loads.

/// The arguments of a node, as written.
pub(super) struct ProgramArguments<'a> {
    /// Remaps among the arguments: names and their new names.
    pub(super) remaps: Vec<(String, String)>,
    rest: Vec<&'a str>,
}

impl<'a> ProgramArguments<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let (remaps, rest): (Vec<&str>, Vec<&str>) = text
            .split_whitespace()
            .partition(|word| word.contains(":="));
        let remaps = remaps.into_iter().filter_map(|word| word.split_once(":="));
        let is_name = |(from, _): &(&str, &str)| !from.starts_with('_');
        let remaps = remaps.filter(is_name);
        Self {
            remaps: remaps.map(|(a, b)| (a.to_owned(), b.to_owned())).collect(),
            rest,
        }
    }

    /// The package and the class that a nodelet loads: `load image_proc/rectify manager`.
    pub(super) fn nodelet(&self) -> Option<(String, String)> {
        let ["load" | "standalone", class, ..] = self.rest[..] else {
            return None;
        };
        let (package, _) = class.split_once('/')?;
        Some((package.to_owned(), class.to_owned()))
    }

    /// The topics of a program, and whether it publishes them.
    pub(super) fn topics(&self, package: &str, program: &str) -> Vec<(bool, String)> {
        let passed = |input: &str, output: Option<&&str>, ending: &str| {
            let output =
                output.map_or_else(|| format!("{input}{ending}"), |topic| (*topic).to_owned());
            vec![(false, input.to_owned()), (true, output)]
        };
        let many = |is_output: bool, one: &str, others: &[&str]| {
            let others = others.iter().map(|topic| (!is_output, (*topic).to_owned()));
            others.chain([(is_output, one.to_owned())]).collect()
        };
        let rest = &self.rest[..];
        match (package, program, rest) {
            ("topic_tools", "relay", [input, ..]) => passed(input, rest.get(1), "_relay"),
            ("topic_tools", "drop", [input, _, _, ..]) => passed(input, rest.get(3), "_drop"),
            ("topic_tools", "throttle", ["messages", input, _, ..]) => {
                passed(input, rest.get(3), "_throttle")
            }
            ("topic_tools", "throttle", ["bytes", input, _, _, ..]) => {
                passed(input, rest.get(4), "_throttle")
            }
            ("topic_tools", "mux", [output, inputs @ ..]) => many(true, output, inputs),
            ("topic_tools", "demux", [input, outputs @ ..]) => many(false, input, outputs),
            ("image_transport", "republish", [from, ..]) => {
                let of = |name: &str, transport: &str| match transport {
                    "raw" => name.to_owned(),
                    _ => format!("{name}/{transport}"),
                };
                let to = rest.get(1).copied().unwrap_or("raw");
                vec![(false, of("in", from)), (true, of("out", to))]
            }
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topics(package: &str, program: &str, text: &str) -> String {
        let topics = ProgramArguments::new(text).topics(package, program);
        let shown = topics.iter().map(|(publishes, topic)| {
            let sign = if *publishes { "→" } else { "←" };
            format!("{sign}{topic}")
        });
        shown.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn arguments_name_the_topics_of_relays() {
        for (program, text, expected) in [
            ("relay", "a b", "←a →b"),
            ("relay", "a", "←a →a_relay"),
            ("throttle", "messages a 1.0", "←a →a_throttle"),
            ("throttle", "bytes a 1000 1.0 b", "←a →b"),
            ("drop", "a 1 2", "←a →a_drop"),
            ("mux", "out a b mux:=m", "←a ←b →out"),
            ("demux", "in a b", "→a →b ←in"),
            ("relay_field", "a b", ""),
        ] {
            assert_eq!(
                topics("topic_tools", program, text),
                expected,
                "{program} {text}"
            );
        }
        let republish = "compressed in:=/image raw out:=/plain _x:=1";
        assert_eq!(
            topics("image_transport", "republish", republish),
            "←in/compressed →out"
        );
        let remaps = ProgramArguments::new(republish).remaps;
        assert_eq!(remaps.len(), 2);
    }

    #[test]
    fn a_nodelet_is_the_class_that_it_loads() {
        let loads = |text| ProgramArguments::new(text).nodelet();
        let rectify = Some(("image_proc".to_owned(), "image_proc/rectify".to_owned()));
        assert_eq!(loads("load image_proc/rectify manager"), rectify);
        assert_eq!(loads("manager"), None);
    }
}
