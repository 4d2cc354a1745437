"""Prints the licence texts of all crates that the command contains according to `cargo metadata` (standard input), each text once
with who is under it."""

import json
import sys
from collections import defaultdict
from pathlib import Path

texts = defaultdict(list)
metadata = json.load(sys.stdin)
nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
built, found = set(), [metadata["resolve"]["root"]]
while found:
    package = found.pop()
    if package not in built:
        built.add(package)
        deps = nodes[package]["deps"]
        found += [dep["pkg"] for dep in deps if any(kind["kind"] is None for kind in dep["dep_kinds"])]
for package in sorted(metadata["packages"], key=lambda package: (package["name"], package["version"])):
    if package["id"] not in built or package["source"] is None:
        continue
    name = f"{package['name']} {package['version']} ({package['license'] or 'see its text'})"
    files = [
        file
        for file in sorted(Path(package["manifest_path"]).parent.iterdir())
        if file.is_file() and file.name.upper().startswith(("LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE"))
    ]
    for text in {file.read_text(errors="replace").strip() for file in files} or {""}:
        texts[text].append(name)
for text, names in sorted(texts.items(), key=lambda item: (item[1], item[0])):
    print("\n".join(sorted(names)), end="\n\n")
    print(text or "Its archive does not contain a licence; the text of the licence named above applies.", end=f"\n\n{'-' * 80}\n\n")
