#!/bin/sh
# Makes the figures and sets the paper: needs bagreel on the path and a TeX Live with the packages graphicx and animate.
set -eu
cd "$(dirname "$0")"
bag=../warehouse.bag
printf '\\newcommand{\\version}{%s}\n' "$(bagreel --version)" > version.tex
# The width of the page, the width of a column: bagreel says so if a text would be smaller than 6 pt there.
bagreel render "$bag" --period 30 --style paper --mode nodes --collapse /robot1 --collapse /robot2 --collapse /fleet \
    --strip 1x3 --width 180mm -o strip.pdf
bagreel render "$bag" --period 30 --style paper --ns-filter '/robot1/*' --strip 1x3 --width 88mm -o column.pdf
bagreel render "$bag" --period 30 --style paper -o mission.pdf
pdflatex -interaction=nonstopmode -halt-on-error paper.tex
# Once more for references and the animation.
pdflatex -interaction=nonstopmode -halt-on-error paper.tex
