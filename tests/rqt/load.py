#!/usr/bin/env python3
"""Load DOT files through the real qt_dotgraph, as rqt_graph's "Load DOT" does, and check that everything is in its place.

usage: QT_QPA_PLATFORM=offscreen load.py QT_DOTGRAPH_SRC FILE.dot… [--qt PyQt5|PySide6]

QT_DOTGRAPH_SRC is the `qt_dotgraph/src` folder of a checkout of ros-visualization/qt_gui_core. Needs `pip install pydot` and
PyQt5 or PySide6; no ROS and no display.

Exit status: 0 every node, cluster and edge of every file became an item, in its place within 1 point; 1 some did not;
2 could not load.
"""
import argparse
import importlib
import os
import re
import subprocess
import sys
import traceback
import types

os.environ.setdefault('QT_QPA_PLATFORM', 'offscreen')
NODE = re.compile(r'\s*("[^"]*"|\w+) \[label=.* pos="([-\d.]+),([-\d.]+)", width=([\d.]+), height=([\d.]+)')
CLUSTER = re.compile(r'\s*subgraph ("[^"]*"|\w+) \{ graph \[bb="([-\d.]+),([-\d.]+),([-\d.]+),([-\d.]+)"')
EDGE = re.compile(r'\s*("[^"]*"|\w+) -> ("[^"]*"|\w+) \[pos="e,([-\d.]+),([-\d.]+) ')


def bind_qt(name):
    """Give qt_dotgraph the `python_qt_binding` that it imports."""
    package = types.ModuleType('python_qt_binding')
    package.__path__ = []
    sys.modules['python_qt_binding'] = package
    for module in ('QtCore', 'QtGui', 'QtWidgets'):
        real = importlib.import_module('%s.%s' % (name, module))
        setattr(package, module, real)
        sys.modules['python_qt_binding.' + module] = real


def places(text):
    """The content of the file: centre and size per node and cluster, with y down; the tips of edges."""
    boxes, tips = {}, []
    for line in text.split('\n'):
        if m := NODE.match(line):
            x, y, w, h = (float(v) for v in m.groups()[1:])
            boxes[m[1]] = (x, -y, w * 72, h * 72)
        elif m := CLUSTER.match(line):
            x0, y0, x1, y1 = (float(v) for v in m.groups()[1:])
            boxes[m[1]] = ((x0 + x1) / 2, -(y0 + y1) / 2, x1 - x0, y1 - y0)
        elif m := EDGE.match(line):
            tips.append((m[1], m[2], float(m[3]), -float(m[4])))
    return boxes, tips


def check(generator, scene, path):
    """Print the problems of a file; true if there are none."""
    with open(path, encoding='utf-8') as file:
        text = file.read()
    nodes, edges = generator.dotcode_to_qt_items(text, highlight_level=3, same_label_siblings=True, scene=scene)
    boxes, tips = places(text)
    worst = 0.0
    for name, item in nodes.items():
        if name not in boxes:
            print('%s: %s has no place in the file' % (path, name))
            return False
        rect, (x, y, w, h) = item._graphics_item.boundingRect(), boxes[name]
        # Nodes are drawn a point smaller than they are, with a pen that adds up to a point again.
        worst = max(worst, abs(rect.center().x() - x), abs(rect.center().y() - y),
                    abs(rect.width() - w), abs(rect.height() - h))
    drawn = sum(len(items) for items in edges.values())
    heads = [item._arrow.polygon() for items in edges.values() for item in items if item._arrow is not None]
    ends = sorted((round(p.at(2).x() if hasattr(p, 'at') else p[2].x()), round(p.at(2).y() if hasattr(p, 'at') else p[2].y()))
                  for p in heads)
    want = sorted((round(x), round(y)) for _, _, x, y in tips)
    apart = max((max(abs(a[0] - b[0]), abs(a[1] - b[1])) for a, b in zip(ends, want)), default=0)
    good = len(nodes) == len(boxes) and drawn == len(tips) == len(ends) and worst <= 1.01 and apart <= 1
    print('%s: %d of %d nodes and clusters, %d of %d edges, places within %.2f points, tips within %d: %s' % (
        path, len(nodes), len(boxes), drawn, len(tips), worst, apart, 'good' if good else 'BAD'))
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('qt_dotgraph')
    parser.add_argument('files', nargs='+')
    parser.add_argument('--qt', default='PyQt5')
    args = parser.parse_args()
    if len(args.files) > 1:
        # PySide6 counts references to None wrongly, and before Python 3.12 aborts after some thousand items.
        command = [sys.executable, __file__, '--qt', args.qt, args.qt_dotgraph]
        return max(abs(subprocess.call(command + [path])) for path in args.files)
    try:
        bind_qt(args.qt)
        sys.path.insert(0, args.qt_dotgraph)
        from python_qt_binding.QtWidgets import QApplication, QGraphicsScene
        application = QApplication(['load'])
        from qt_dotgraph.dot_to_qt import DotToQtGenerator
    except ImportError as error:
        print('skipped: %s' % error)
        return 2
    try:
        good = check(DotToQtGenerator(), QGraphicsScene(), args.files[0])
    except Exception:
        traceback.print_exc()
        return 2
    del application
    return 0 if good else 1


if __name__ == '__main__':
    STATUS = main()
    sys.stdout.flush()
    # For the same reason it may abort while the interpreter shuts down, whatever was loaded.
    os._exit(STATUS)
