#!/bin/sh
# Makes the three figures and typesets the page. Needs bagreel on the path (or BAGREEL=…) and pdfLaTeX with graphicx.
set -eu
cd "$(dirname "$0")"
bagreel=${BAGREEL:-bagreel}
bag=../warehouse.bag
# A column is 88 mm wide, the page 180 mm. Figures of that --width are included without scaling, so that 6 pt stay 6 pt.
# With --bare, the legend is part of the caption in the .tex file.
for figure in lives:88mm map:88mm steps:180mm; do
    "$bagreel" figure "$bag" --kind "${figure%%:*}" --width "${figure##*:}" --phases phases.txt --bare \
        -o "${figure%%:*}.pdf" -o "${figure%%:*}.tex"
done
# Twice, for the references.
pdflatex -interaction=nonstopmode -halt-on-error paper.tex
pdflatex -interaction=nonstopmode -halt-on-error paper.tex
# The picture in the README.
if command -v pdftoppm > /dev/null; then
    pdftoppm -r 100 -png -singlefile paper.pdf page
fi
