#!/bin/sh
# Makes what a paper about a recording needs: its digest, its survey, its events and three figures; and typesets the page.
# Needs bagreel on the path (or BAGREEL=…), sha256sum, and for the page pdfLaTeX with graphicx.
set -eu
cd "$(dirname "$0")"
bagreel=${BAGREEL:-bagreel}
bag=../warehouse.bag
# For replication: `sha256sum -c SHA256SUMS` checks the recording, and this script with this version makes the same bytes.
sha256sum "$bag" > SHA256SUMS
"$bagreel" --version > VERSION
"$bagreel" info "$bag" --format csv > survey.csv
"$bagreel" events "$bag" --format csv > events.csv
# A column is 88 mm wide, the page 180 mm. Figures of that --width are included without scaling, so that 6 pt stay 6 pt.
# With --bare, the legend is part of the caption in the .tex file.
figure() {
    kind=$1
    shift
    "$bagreel" figure "$bag" --kind "$kind" "$@" --phases phases.txt --bare -o "$kind.pdf" -o "$kind.tex"
}
figure lives --width 88mm
figure graph --width 88mm
figure steps --width 180mm --steps 3,4
if ! command -v pdflatex > /dev/null; then
    echo "the page is not typeset: pdflatex is not installed" >&2
    exit 0
fi
# Twice, for the references.
pdflatex -interaction=nonstopmode -halt-on-error paper.tex
pdflatex -interaction=nonstopmode -halt-on-error paper.tex
# The picture in the README.
if command -v pdftoppm > /dev/null; then
    pdftoppm -r 100 -png -singlefile paper.pdf page
fi
