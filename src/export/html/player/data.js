// The page's data, unpacked: any value of any element in any window is found by one search. `data.rs`
// describes it.
const $ = new Proxy({}, { get: (_, id) => document.getElementById(id) });
const setText = (id, text) => { const element = $[id]; if (element.textContent != text) element.textContent = text; };
const make = (tag, props, ...inside) => {
	const element = Object.assign(document.createElement(tag), props);
	element.append(...inside);
	return element;
};
const set = (element, attributes) => { for (const key in attributes) element.setAttribute(key, attributes[key]); return element; };
const drawn = (tag, attributes, textContent = '') => set(Object.assign(document.createElementNS('http://www.w3.org/2000/svg', tag), { textContent }), attributes);
async function unpacked({ type, textContent: text }) {
	if (type != 'deflated') return text;
	const bytes = Uint8Array.from(atob(text), c => c.charCodeAt());
	return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'))).text();
}
const data = JSON.parse(await unpacked($.data));
setText('data', '');
const { words, starts, ends, reported, phases, rows, takeovers, sizes } = data;
const isPhone = () => innerWidth <= 760;
const W = starts.length, last = W - 1, total = Math.max(...ends.slice(-50), 1e-3);
// The length of the lifelines: for two missions, whose windows have no times, that of the longer one.
const long = data.sides ? Math.max(1e-3, ...rows.flatMap(([, , , lifetimes]) => lifetimes.filter((_, k) => k % 3 < 2))) : total;
// The window that contains a time: the last one that begins before it.
const windowAt = s => Math.max(0, starts.findLastIndex(start => start <= s + 1e-6));
const iso = (s, from, to) => new Date(Math.round(s * 1e3)).toISOString().slice(from, to).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '');
const clock = s => data.sides?.[windowAt(s)] ?? iso(s, s < 3600 ? 14 : 11, s % 1 ? 23 : 19);

// The value of a run list in a window, and the index of its run.
function place(list, w, lo = 0, hi = list.length) {
	while (lo < hi) { const mid = (lo + hi >> 2) * 2; list[mid] <= w ? lo = mid + 2 : hi = mid; }
	return lo;
}
const at = (list, w) => { const p = place(list, w); return p && list[p - 1]; };
const KINDS = ['added', 'removed', 'changed'], ITEMS = ['node', 'topic', 'topics', 'namespace'];
const NONE = [];

// Elements are numbered: items, then arrows.
class Graph {
	constructor({ names, kinds, arrows, facts, boxes, classes, labels, runs, members }, svg) {
		Object.assign(this, { names, kinds, arrows, boxes, classes, labels, members, svg, N: names.length, count: names.length + arrows.length });
		this.runs = runs.map(lists => [0, 1, 2, 3, 4].map(k => lists[k] ?? NONE));
		for (const list of runs.flat()) for (let i = 2; i < list.length; i += 2) list[i] += list[i - 2];
		this.facts = facts.map(list => list.map(f => words[f]));
		this.els = svg ? ['.items', '.arrows'].flatMap(layer => [...svg.querySelector(layer).children]) : [];
		// The frames of namespaces, with the items inside.
		this.spaces = [...svg?.querySelectorAll('.spaces > g') ?? []].map(frame => {
			const [x, y, w, h] = ['x', 'y', 'width', 'height'].map(key => +frame.querySelector('rect').getAttribute(key));
			return [frame, [...names.keys()].filter(i => boxes[i][0] >= x - 1 && boxes[i][1] >= y - 1 && boxes[i][0] + boxes[i][2] <= x + w + 1 && boxes[i][1] + boxes[i][3] <= y + h + 1)];
		}).filter(([, inside]) => inside.length);
		this.els.slice(this.N).forEach((e, k) => { [e.dataset.from, e.dataset.to] = arrows[k].map(i => names[i]); });
		this.base = this.els.map(e => e.classList[0] + ' ');
		this.live = this.els.map(e => e.querySelector('.r'));
		this.cur = this.els.map(() => '');
		this.dom = new Map(this.els.map((e, i) => [e, i]));
		// The meaning of a class: its mark, whether the element exists, and the class without marks.
		this.marks = classes.map(c => KINDS.findIndex(k => c.split(' ').includes(k)));
		// What is away is drawn, with its topics and lines, although it does not exist.
		this.there = classes.map((c, k) => k > 0 && this.marks[k] != 1 && !/ away|^silent declared$/.test(c));
		this.plain = classes.map(c => c.split(' ').filter((word, k) => !k || /^(stated|inferred|declared|starved|w\d)$/.test(word)).join(' '));
		this.neighbours = names.map(() => []);
		arrows.forEach(([a, b], k) => { this.neighbours[a].push(this.N + k); if (a != b) this.neighbours[b].push(this.N + k); });
		this.keys = new Map();
		for (let i = 0; i < this.count; i++) this.keys.set(this.key(i), i);
	}
	ends(i) { return i < this.N ? this.neighbours[i] : this.arrows[i - this.N].slice(0, 2); }
	// An element with its connections and the elements at their other ends.
	nearby(i) { return [i, ...this.ends(i).flatMap(end => end < this.N ? end : [end, ...this.ends(end)])]; }
	name(i) {
		if (i < this.N) return this.names[i];
		const [a, b, topic] = this.arrows[i - this.N];
		return this.names[a] + ' → ' + this.names[b] + (topic && ' over ' + topic);
	}
	kind(i) { return i < this.N ? ITEMS[this.kinds[i]] : 'edge'; }
	key(i) { return this.kind(i) + ':' + this.name(i); }
	type(i) { return this.facts[i].find(f => f.startsWith('type ')) ?? ''; }
	class(i, w) { return at(this.runs[i][0], w); }
	isThere(i, w) { return this.there[this.class(i, w)]; }
	// Messages in some windows, the time in seconds, and whether any are known.
	sent(i, from, to = from) {
		let sum = 0, time = 0, isKnown = false;
		for (let w = from; w <= to; w++) {
			const number = this.class(i, w) && this.labels[at(this.runs[i][4], w)], seconds = ends[w] - starts[w];
			time += seconds;
			sum += (+number || 0) * seconds;
			isKnown ||= !!number;
		}
		return [sum, time, isKnown];
	}
	// Messages per second over some windows: as a number, and in words.
	hz(i, from, to) {
		const [sum, time] = this.sent(i, from, to);
		return sum && sum / time;
	}
	rate(i, from, to = from) {
		const [sum, time, isKnown] = this.sent(i, from, to), hz = sum && sum / time;
		if (!isKnown || !sum && /^(latched|declared)/.test(this.classes[this.class(i, to)])) return '';
		const each = / each$/.test(this.labels[at(this.runs[i][1], to)]) ? ' each' : '';
		return (Math.abs(sum - 1) < .01 ? '1 msg' : withUnit(hz)) + each;
	}
	lifecycle(i, w) { return this.labels[at(this.runs[i][2], w)]; }
	rateChange(i, w) {
		const list = this.runs[i][3], p = place(list, w);
		return p && list[p - 2] == w ? this.labels[list[p - 1]] : '';
	}
	// The difference between two windows: class words and text.
	difference(i, from, to) {
		const a = this.isThere(i, from), b = this.isThere(i, to);
		if (!a && !b) return NONE;
		if (!a) return ['added', this.rate(i, to)];
		if (!b) return ['removed', this.rate(i, from)];
		const before = this.hz(i, from), after = this.hz(i, to), change = `${this.rate(i, from)} → ${this.rate(i, to)}`;
		if (Math.abs(after - before) > data.change * (before || after) * (1 + 1e-9)) return [after > before ? 'changed faster' : 'changed slower', change];
		const [x, y] = [from, to].map(w => this.lifecycle(i, w));
		return x != y ? ['changed other', `${x || '?'} → ${y || '?'}`] : NONE;
	}
}
const whole = new Graph(data.graphs[0], document.querySelector('#graph .items') && $.graph);
const folded = data.graphs[1] && new Graph(data.graphs[1], $.folded);
const headlines = new Map(reported.map(([w, n, counts, lines, words]) => [w, { n, counts, lines, words }]));
