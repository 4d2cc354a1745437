#!/usr/bin/env python3
"""Counts defects in pictures of a mission, measured on their SVG. Run by hand:

    tests/bench/pictures.py BAGREEL BAG... [-- OPTION...]

Prints per bag, over all frames: boxes and lines per frame; crossings of lines per frame; lines with a twin between the same
two boxes; new lines without a name; labels with a line of others under them; titles of namespaces with a line under them;
badges on a line of others; heads of lines below words; changes that are folded away; most things with a colour in a frame; the
smallest text in pixels; the part of the graph's page that boxes fill.
"""

import collections
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET

SVG = "{http://www.w3.org/2000/svg}"
# The width of a letter as a share of its size.
LETTER = 0.55


def points(path):
    """Points along a path, close enough to each other to find what it runs under."""
    found, here = [], (0.0, 0.0)
    for letter, rest in re.findall(r"([MLCZ])([^MLCZ]*)", path):
        numbers = [float(n) for n in re.findall(r"-?[\d.]+", rest)]
        pairs = list(zip(numbers[::2], numbers[1::2]))
        if letter == "C":
            for k in range(0, len(pairs) - 2, 3):
                a, b, c = pairs[k : k + 3]
                for step in range(1, 17):
                    t = step / 16
                    u = 1 - t
                    found.append(tuple(
                        u**3 * here[d] + 3 * u * u * t * a[d] + 3 * u * t * t * b[d] + t**3 * c[d] for d in (0, 1)
                    ))
                here = c
        elif letter == "L":
            for end in pairs:
                found += [tuple(here[d] + (end[d] - here[d]) * k / 16 for d in (0, 1)) for k in range(1, 17)]
                here = end
        elif pairs:
            here = pairs[-1]
            found.append(here)
    return found


def box(text):
    """The rectangle of a text: left, top, right, bottom."""
    size, x, y = (float(text.get(key, 0)) for key in ("font-size", "x", "y"))
    wide = len("".join(text.itertext())) * size * LETTER
    left = x - {"middle": wide / 2, "end": wide}.get(text.get("text-anchor"), 0)
    return left, y - size * 0.75, left + wide, y + size * 0.1


def inside(place, x, y):
    """Whether a point is in a rectangle."""
    left, top, right, bottom = place
    return left < x < right and top < y < bottom


def centre(form):
    """The middle of an ellipse."""
    return float(form.get("cx")), float(form.get("cy"))


def crossings(lines):
    """How often lines between different pairs of boxes cross."""
    cells, found = collections.defaultdict(list), set()
    for at, line in enumerate(lines):
        for way in line["ways"]:
            for a, b in zip(way, way[1:]):
                piece = at, a, b
                for x in range(*span(a[0], b[0])):
                    for y in range(*span(a[1], b[1])):
                        for other in cells[x, y]:
                            if lines[other[0]]["pair"] != line["pair"] and cross(piece, other):
                                found.add((other, piece))
                        cells[x, y].append(piece)
    return len(found)


def span(a, b):
    """The cells of a grid from one coordinate to another."""
    return int(min(a, b) // 16), int(max(a, b) // 16) + 1


def cross(one, other):
    """Whether two straight pieces cross; those that only touch do not."""
    (_, a, b), (_, c, d) = one, other
    side = lambda p, q, r: (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    return side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0


def shape(group):
    """The rectangle of the box of a node or topic."""
    for form in group:
        numbers = {key: float(value) for key, value in form.attrib.items() if re.fullmatch(r"-?[\d.]+", value)}
        if form.tag == SVG + "rect":
            return numbers["width"] * numbers["height"]
        if form.tag == SVG + "ellipse":
            return numbers["rx"] * numbers["ry"] * 3.14
    return 0.0


def frame(root, sums):
    """Adds the defects of one frame."""
    lines, labels, filled = {}, [], 0.0
    titles, badges, heads, coloured = [], [], [], set()
    smallest = 1e9
    for group in root.iter(SVG + "g"):
        words = group.get("class", "").split()
        kind = words[0] if words else ""
        texts = [text for text in group if text.tag == SVG + "text"]
        for text in texts:
            smallest = min(smallest, float(text.get("font-size")))
        if kind == "edge":
            name = group.get("id").split("..over")[0]
            ends = group.get("data-from"), group.get("data-to")
            line = lines.setdefault(
                name,
                {"ends": ends, "pair": frozenset(ends), "points": [], "ways": [], "words": words, "label": False},
            )
            line["label"] |= any(re.search("[a-z]{2}", "".join(t.itertext()).replace("Hz", "")) for t in texts)
            labels += [(name, box(text)) for text in texts]
            for path in group.iter(SVG + "path"):
                way = points(path.get("d"))
                if path.get("d").endswith("Z"):
                    heads.append((name, way[0]))
                else:
                    line["points"] += way
                    line["ways"].append(way)
            line["topics"] = group.get("data-topics")
            badges += [(name, centre(form)) for form in group.iter(SVG + "ellipse") if float(form.get("rx")) > 4]
        elif kind in ("node", "topic"):
            sums["boxes"] += 1
            filled += shape(group)
            sums["folded"] += group.get("data-mark") == "inside"
            badges += [(None, centre(form)) for form in list(group)[1:] if form.tag == SVG + "ellipse"]
        elif kind == "namespace-title":
            titles += [box(text) for text in texts]
        if {"added", "removed", "changed", "away"} & set(words):
            coloured |= set((group.get("data-entries") or "").split())
    pairs = collections.Counter(line["pair"] for line in lines.values())
    sums["lines"] += len(lines)
    sums["crossings"] += crossings(list(lines.values()))
    sums["twins"] += sum(pairs[line["pair"]] > 1 for line in lines.values())
    # The box of a topic names the lines to it.
    topics = {group.get("data-name") for group in root.iter(SVG + "g") if group.get("class", "").startswith("topic ")}
    new = [line for line in lines.values() if "added" in line["words"] and not topics & set(line["ends"])]
    sums["new"] += len(new)
    # The lines of a fork have one label.
    named = {(line["ends"][0], line["topics"]) for line in lines.values() if line["label"]}
    sums["nameless"] += sum((line["ends"][0], line["topics"]) not in named for line in new)
    sums["labels"] += len(labels)
    for own, (left, top, right, bottom) in labels:
        sums["covered"] += any(
            left < x < right and top < y < bottom
            for name, line in lines.items()
            if name != own
            for x, y in line["points"]
        )
    runs = [(name, x, y) for name, line in lines.items() for x, y in line["points"]]
    sums["titles"] += len(titles)
    sums["crossed"] += sum(any(inside(place, x, y) for _, x, y in runs) for place in titles)
    sums["badges"] += len(badges)
    sums["run over"] += sum(
        any(name != own and (x - bx) ** 2 + (y - by) ** 2 < 36 for name, x, y in runs) for own, (bx, by) in badges if own
    )
    words = [(None, place) for place in titles] + labels
    sums["hidden"] += sum(any(own != name and inside(place, x, y) for own, place in words) for name, (x, y) in heads)
    sums["colours"] = max(sums["colours"], len(coloured))
    wide, high = (float(n) for n in root.get("viewBox").split()[2:])
    sums["filled"] += filled / (wide * high)
    return smallest


def main():
    args = sys.argv[1:]
    options = args[args.index("--") + 1 :] if "--" in args else []
    bagreel, *bags = args[: args.index("--")] if "--" in args else args
    print("| bag | frames | boxes | lines | crossings | twins | new without a name | labels over lines | titles crossed "
          "| badges run over | heads hidden | folded | most coloured | smallest text | filled |")
    print("|---" * 15 + "|")
    for bag in bags:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([bagreel, "render", "-q", bag, *options, "-o", folder + "/x{n}.svg"], check=True)
            files = sorted(pathlib.Path(folder).iterdir())
            sums = collections.Counter()
            smallest = min(frame(ET.parse(file).getroot(), sums) for file in files)
        many = len(files)
        share = f"{100 * sums['covered'] / max(sums['labels'], 1):.0f} %"
        print(
            f"| {pathlib.Path(bag).name} | {many} | {sums['boxes'] / many:.0f} | {sums['lines'] / many:.0f} "
            f"| {sums['crossings'] / many:.1f} | {sums['twins']} "
            f"| {sums['nameless']} of {sums['new']} | {share} | {sums['crossed']} of {sums['titles']} "
            f"| {sums['run over']} of {sums['badges']} | {sums['hidden']} | {sums['folded']} | {sums['colours']} | {smallest:.1f} px "
            f"| {100 * sums['filled'] / many:.0f} % |"
        )


if __name__ == "__main__":
    main()
