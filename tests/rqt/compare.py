#!/usr/bin/env python3
"""Compare our views with those of the real rqt_graph, on random graphs and all settings of its window.

usage: compare.py BINARY RQT_GRAPH_SRC QT_DOTGRAPH_SRC [--cases 3000] [--seed 1] [--keep FOLDER]

BINARY           a built `bagreel`
RQT_GRAPH_SRC    the `src` folder of a checkout of ros-visualization/rqt_graph (branch rolling)
QT_DOTGRAPH_SRC  the `qt_dotgraph/src` folder of a checkout of ros-visualization/qt_gui_core

Needs Python 3.9 and `pip install pydot`; no ROS and no display. Every case is a random graph with random settings. Its
graph goes to rqt_graph's own `dotcode.py` and, as a mission of one window, to `bagreel render x.json -o x.dot`. Ids,
labels, shapes, tool tips and URLs of nodes and topics, the cluster of each, the nesting of clusters, and
the ends and labels of edges must be equal, but for the differences named in README.md, which are counted.

Exit status: 0 all equal, 1 some differ (the first ones are printed, and kept with --keep), 2 could not compare.
"""
import argparse
import collections
import json
import pathlib
import random
import subprocess
import sys
import tempfile
import types

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / 'support'))
import windows

SETTINGS = {
    'mode': ['node_node', 'node_topic', 'node_topic_all'],
    'cluster': [0, 1, 2, 3, 5],
    'dead': [False, True], 'leaf': [False, True], 'quiet': [False, True], 'hide_tf': [False, True],
    'params': [False, True], 'actions': [False, True], 'images': [False, True], 'tf': [False, True],
}
DEFAULTS = dict(mode='node_node', cluster=2, dead=True, leaf=True, quiet=True, hide_tf=False, params=True,
                actions=True, images=True, tf=True, ns='/', topic='/')
FILTERS = ['/', '', '/a.*', '/a/.*', '-/a.*', '/a,/b', '/.*,-/b/.*', '/tf', '/tf.*', '-/tf.*', '/a|/b', '.*e', '/talker',
           '-/rqt.*,-/rviz', '/[ab]/.*', ' /a/b/c , /b.* ', '/(a|c)/x', '/,/a', '-/a/b']
PARTS = ['a', 'b', 'c', 'x', 'talker', 'nav', 'camera', 'move_base', 'a_b', 'rviz', 'rqt_gui', 'monitor', '_hidden', 'cmd-vel',
         'diag_agg', 'clock']
TOPICS = ['/tf', '/tf_static', '/rosout', '/clock', '/statistics', '/parameter_events', '/time', '/rosout_agg', '/diagnostics']
FAMILIES = [['/status', '/result', '/goal', '/cancel', '/feedback'], ['', '/compressed', '/compressedDepth', '/theora'],
            ['/parameter_updates', '/parameter_descriptions'], ['/parameter_events']]


def name(rng):
    return ''.join('/' + rng.choice(PARTS) for _ in range(rng.choice([1, 1, 2, 2, 3, 4])))


def random_graph(rng):
    """Nodes, and edges as (node, topic, is it a publication). Every topic has an edge, as on a ROS master. No topic has the name of a node, since rqt_graph confuses the two."""
    nodes = sorted({name(rng) for _ in range(rng.randint(1, 10))})
    topics = {name(rng) for _ in range(rng.randint(1, 8))} | set(rng.sample(TOPICS, rng.randint(0, 4)))
    for _ in range(rng.randint(0, 2)):
        family, base = rng.choice(FAMILIES), name(rng)
        few = rng.sample(family, rng.randint(1, len(family)))
        topics |= {base + suffix for suffix in (family if rng.random() < .7 else few)}
    topics = sorted(topics - set(nodes))
    edges = set()
    for topic in topics:
        for _ in range(rng.choice([1, 1, 2, 2, 3, 5])):
            edges.add((rng.choice(nodes), topic, rng.random() < .5))
    return nodes, sorted(edges)


def random_settings(rng):
    if rng.random() < .1:
        return dict(DEFAULTS)
    settings = {key: rng.choice(values) for key, values in SETTINGS.items()}
    pick = lambda: '/' if rng.random() < .5 else rng.choice(FILTERS)  # noqa: E731
    return dict(settings, ns=pick(), topic=pick())


def load_rqt(rqt, qtd):
    """rqt_graph's generator and its DOT factory, with empty stubs for ROS and Qt."""
    def stub(module, **attributes):
        made = types.ModuleType(module)
        made.__path__ = []
        made.__dict__.update(attributes)
        sys.modules[module] = made
    stub('rclpy')
    stub('rclpy.qos', qos_check_compatible=None, QoSCompatibility=None)
    stub('python_qt_binding')
    stub('python_qt_binding.QtCore', qDebug=lambda *a: None, qWarning=lambda *a: None)
    sys.path[:0] = [rqt, qtd]
    from qt_dotgraph.pydotfactory import PydotFactory
    from rqt_graph import rosgraph2_impl as impl
    from rqt_graph.dotcode import RosGraphDotcodeGenerator
    return RosGraphDotcodeGenerator(None), PydotFactory(), impl


def theirs(rqt, nodes, edges, s):
    """The pydot graph that rqt_graph draws."""
    generator, factory, impl = rqt
    g = types.SimpleNamespace(bad_nodes={}, topic_with_qos_incompatibility={}, nn_nodes=list(nodes))
    g.nt_nodes = [impl.topic_node(t) for t in sorted({t for _, t, _ in edges})]
    g.nt_edges, g.nn_edges = impl.EdgeList(), impl.EdgeList()
    pubs, subs = collections.defaultdict(list), collections.defaultdict(list)
    for node, topic, is_pub in edges:
        g.nt_edges.add_edges(node, impl.topic_node(topic), 'o' if is_pub else 'i', qos=None)
        (pubs if is_pub else subs)[topic].append(node)
    g.nt_all_edges = g.nt_edges
    for topic, ends in pubs.items():
        for pub in ends:
            for sub in subs[topic]:
                g.nn_edges.add_edges(pub, sub, 'o', topic)
    return generator.generate_dotgraph(
        g, s['ns'], s['topic'], s['mode'], factory, hide_single_connection_topics=s['leaf'],
        hide_dead_end_topics=s['dead'], cluster_namespaces_level=s['cluster'], accumulate_actions=s['actions'],
        orientation='LR', quiet=s['quiet'], unreachable=True, group_tf_nodes=s['tf'], hide_tf_nodes=s['hide_tf'],
        group_image_nodes=s['images'], hide_dynamic_reconfigure=s['params'])


def mission(nodes, edges):
    """One window, with only the required keys of a mission and the counts of topics."""
    window = {'index': 0, 'start_ns': 0, 'end_ns': 10**10, 'nodes': [{'name': n} for n in nodes],
              'topics': [{'name': t} for t in sorted({t for _, t, _ in edges})],
              'publishes': [{'node': n, 'topic': t} for n, t, pub in edges if pub],
              'subscribes': [{'topic': t, 'node': n} for n, t, pub in edges if not pub]}
    return windows.join({'windows': [window]})


def flags(s):
    if s == DEFAULTS:
        return ['--rqt-defaults']
    hide = [ours for ours, key in [('debug', 'quiet'), ('dead', 'dead'), ('leaf', 'leaf'), ('tf', 'hide_tf'),
                                   ('params', 'params')] if s[key]]
    mode = {'node_node': 'nodes', 'node_topic': 'active', 'node_topic_all': 'all'}[s['mode']]
    # Between nodes, rqt_graph draws every topic of an action.
    kinds = ('tf', 'images') if mode == 'nodes' else ('actions', 'tf', 'images')
    group = ['namespaces=%d' % s['cluster']] + [key for key in kinds if s[key]]
    return ['--mode', mode, '--ns-filter', s['ns'], '--topic-filter', s['topic'],
            '--hide', ','.join(hide) or 'none', '--group', ','.join(group)]


def ours(binary, folder, nodes, edges, s):
    source, target = folder / 'x.json', folder / 'x.dot'
    source.write_text(json.dumps(mission(nodes, edges)))
    target.unlink(missing_ok=True)
    command = [binary, 'render', str(source), '-o', str(target), '--fit', 'none', '--quiet'] + flags(s)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit('%s\n%s' % (' '.join(command), done.stderr))
    return target.read_text()


def read(graph):
    """The content of a pydot graph: nodes, clusters, edges."""
    nodes, clusters, edges = {}, {}, set()

    def text(value):
        return value.strip('"') if value else value

    def walk(part, home):
        for node in part.get_node_list():
            key = text(node.get_name())
            if key not in ('graph', 'node', 'edge', '\\n'):
                nodes[key] = tuple(text(node.get(a)) for a in ('label', 'shape', 'tooltip', 'URL')) + (home,)
        for cluster in part.get_subgraph_list():
            key = text(cluster.get_name())
            bare = [n for n in cluster.get_node_list() if n.get_name() == 'graph']
            label = cluster.get('label') or (bare[0].get('label') if bare else None)
            clusters[key] = (text(label), home)
            walk(cluster, key)
        for edge in part.get_edge_list():
            label = (text(edge.get('label')) or '').split('\\n')[0]
            edges.add((text(edge.get_source()), text(edge.get_destination()), label))
    walk(graph, None)
    return nodes, clusters, edges


def forgive(shown, settings, edges, counts):
    """Remove the documented differences from rqt_graph's content."""
    nodes, clusters, lines = shown
    if settings['params']:
        topics = {t for _, t, _ in edges}
        for topic in topics:
            for this, other in (('updates', 'descriptions'), ('descriptions', 'updates')):
                suffix = '/parameter_' + this
                if topic.endswith(suffix) and topic[:-len(suffix)] + '/parameter_' + other in topics:
                    gone = [key for key, value in nodes.items() if value[0] == topic and value[1] == 'box']
                    counts['parameter_updates'] += len(gone)
                    for key in gone:
                        del nodes[key]
                    if settings['mode'] == 'node_node':
                        lines -= {line for line in lines if line[2] == topic}
    ghosts = {line for line in lines if line[0] not in nodes or line[1] not in nodes}
    counts['edges to ghosts'] += len(ghosts)
    lines -= ghosts
    inhabited = set()
    for value in nodes.values():
        home = value[4]
        while home is not None and home not in inhabited:
            inhabited.add(home)
            home = clusters[home][1]
    counts['clusters left empty'] += len(set(clusters) - inhabited)
    for key in set(clusters) - inhabited:
        del clusters[key]


def difference(a, b):
    """The first differences, as text."""
    out = []
    for what, x, y in zip(('nodes', 'clusters', 'edges'), a, b):
        x, y = (set(z.items()) if isinstance(z, dict) else z for z in (x, y))
        if x != y:
            out.append('%s only in rqt_graph: %s; only in ours: %s' % (what, sorted(x - y, key=str), sorted(y - x, key=str)))
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('binary')
    parser.add_argument('rqt_graph')
    parser.add_argument('qt_dotgraph')
    parser.add_argument('--cases', type=int, default=3000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--keep', type=pathlib.Path)
    args = parser.parse_args()
    try:
        import pydot
        rqt = load_rqt(args.rqt_graph, args.qt_dotgraph)
    except ImportError as error:
        print('skipped: %s' % error)
        return 2
    counts, wrong = collections.Counter(), 0
    with tempfile.TemporaryDirectory() as folder:
        for case in range(args.cases):
            rng = random.Random('%d/%d' % (args.seed, case))
            (nodes, edges), settings = random_graph(rng), random_settings(rng)
            text = theirs(rqt, nodes, edges, settings).to_string()
            want = read(pydot.graph_from_dot_data(text)[0])
            forgive(want, settings, edges, counts)
            made = ours(args.binary, pathlib.Path(folder), nodes, edges, settings)
            got = read(pydot.graph_from_dot_data(made)[0])
            counts['nodes'] += len(got[0])
            counts['edges'] += len(got[2])
            counts['clusters'] += len(got[1])
            counts['groups'] += sum(n[1] == 'box3d' for n in got[0].values())
            lines = difference(want, got)
            if not lines:
                continue
            wrong += 1
            if wrong <= 10:
                print('case %d: %s\n  %s' % (case, ' '.join(flags(settings)), '\n  '.join(lines)))
            if args.keep:
                args.keep.mkdir(parents=True, exist_ok=True)
                (args.keep / ('%d.json' % case)).write_text(json.dumps(mission(nodes, edges)))
                (args.keep / ('%d.rqt.dot' % case)).write_text(text)
                (args.keep / ('%d.ours.dot' % case)).write_text(made)
    print('%d cases, seed %d: %d differ' % (args.cases, args.seed, wrong))
    print('compared: %(nodes)d nodes and topics (%(groups)d groups), %(edges)d edges, %(clusters)d clusters' % counts)
    for what in ('edges to ghosts', 'parameter_updates', 'clusters left empty'):
        print('set aside as documented: %d %s' % (counts[what], what))
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
