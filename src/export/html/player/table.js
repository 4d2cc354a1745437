// All elements as a table: kind, name, rate, difference, rate over time, first and last time; sorted and
// filtered.
const COLUMNS = [
	['Kind', i => whole.kind(i)], ['Name', i => whole.name(i)], ['Now', i => whole.hz(i, ...range ?? [now])], ['Change', i => change(i)],
	['Course', i => mean(i)], ['First', i => times(i)[0]], ['Last', i => times(i)[1]], ['State', i => classNow(i).split(' ')[0]],
];
let sortBy = 1, upward = true, most = 200;
const before = () => base < 0 ? Math.max(0, now - 1) : base;
const change = i => range ? 0 : whole.hz(i, now) - whole.hz(i, before());
const classNow = i => range ? looksOf(whole)[i][0] : whole.classes[whole.class(i, now)];
const isHere = i => range ? classNow(i) != 'off' : whole.isThere(i, now);
const courses = new Map();
// The times at which it existed, and its rates in at most 60 steps.
function course(i) {
	if (!courses.has(i)) {
		const list = whole.runs[i][0], there = [];
		for (let k = 0; k < list.length; k += 2) if (whole.there[list[k + 1]]) there.push([starts[list[k]], starts[list[k + 2]] ?? total]);
		const steps = Math.min(W, 60), rates = Array.from({ length: steps }, (_, k) => whole.hz(i, Math.floor((k + .5) * W / steps)));
		courses.set(i, { first: there[0]?.[0] ?? Infinity, last: there.at(-1)?.[1] ?? 0, rates, mean: whole.hz(i, 0, last) });
	}
	return courses.get(i);
}
const times = i => [course(i).first, course(i).last], mean = i => course(i).mean;
function sparkline(rates) {
	const top = Math.max(...rates) || 1, step = 60 / rates.length;
	return `<svg viewBox="0 0 60 14" aria-hidden="true"><path d="M0 14${rates.map((hz, k) => `V${(13 - 12 * hz / top).toFixed(1)}H${((k + 1) * step).toFixed(1)}`).join('')}V14z"/></svg>`;
}
function chosen() {
	const kind = $.tkind.value, text = $.tq.value, all = text ? found(text) : [...Array(kind == 'edge' ? whole.count : whole.N).keys()];
	const words = text.toLowerCase().split(/\s+/).filter(Boolean);
	const edges = kind == 'edge' && text && !/->|→/.test(text) ? [...Array(whole.count - whole.N).keys()].map(k => k + whole.N).filter(i => words.every(word => whole.name(i).toLowerCase().includes(word))) : all;
	return edges.filter(i => {
		const of = whole.kind(i).replace('topics', 'topic').replace('namespace', 'node');
		const state = $.tstate.value;
		return (kind ? of == kind : of != 'edge') && (!state || (state == 'here' ? isHere(i) : !/^(away)?$/.test(signOf(i))));
	});
}
function cells(i) {
	const delta = change(i), { first, last: end, rates } = course(i), away = !isHere(i);
	const cell = (text, className = '') => make('td', { textContent: text, className });
	const spark = make('td', { innerHTML: sparkline(rates), title: `${spell(mean(i))} Hz on average over the mission` });
	return [
		make('td', {}, shape(i), whole.kind(i)), make('td', {}, make('button', { textContent: whole.name(i), onclick: () => { table(false); pick(i, 1); } })),
		cell(!away && whole.rate(i, ...range ?? [now]) || '–', 'n'),
		cell(Math.abs(delta) < 1e-9 ? '' : (delta > 0 ? '+' : '−') + spell(Math.abs(delta)), 'n ' + (delta > 0 ? 'up' : 'down')),
		spark, cell(first == Infinity ? '–' : clock(Math.floor(first)), 'n'), cell(end ? clock(Math.floor(end)) : '–', 'n'),
		cell(away ? 'absent' : classNow(i).split(' ')[0] + (signOf(i) ? ', ' + signOf(i).split(' ').at(-1) : '')),
	];
}
function fillTable() {
	if ($.sheet.hidden) return;
	const value = COLUMNS[sortBy][1], all = chosen(), values = new Map(all.map(i => [i, value(i)]));
	all.sort((a, b) => {
		const [x, y] = [values.get(a), values.get(b)], order = x < y ? -1 : x > y ? 1 : 0;
		return order ? (upward ? order : -order) : a - b;
	});
	const [head, body] = $.sheet.querySelectorAll('thead, tbody');
	head.replaceChildren(make('tr', {}, ...COLUMNS.map(([title], k) => {
		const button = make('button', { textContent: k == 3 ? (base < 0 ? 'Since previous' : `Since window ${base + 1}`) : k == 2 ? range ? 'Rate over the range' : 'Rate now' : title, onclick: () => { upward = sortBy == k ? !upward : k < 2 || k > 4; sortBy = k; fillTable(); $.sheet.querySelectorAll('thead button')[k].focus(); } });
		const cell = make('th', { scope: 'col' }, button);
		cell.ariaSort = sortBy == k ? (upward ? 'ascending' : 'descending') : 'none';
		return cell;
	})));
	body.replaceChildren(...all.slice(0, most).map(i => {
		const row = make('tr', { className: signOf(i) }, ...cells(i));
		row.dataset.key = whole.key(i);
		return row;
	}));
	if (all.length > most) body.append(make('tr', {}, make('td', { colSpan: COLUMNS.length }, make('button', { textContent: `and ${all.length - most} more`, onclick: () => { most *= 4; fillTable(); } }))));
	setText('tcount', `${all.length} of ${$.tkind.value == 'edge' ? whole.count - whole.N : whole.N}`);
}
onSeek.push(fillTable);
function table(on) {
	$.sheet.hidden = !on;
	$.totable.ariaPressed = on;
	if (on) { fillTable(); $.tq.focus(); } else { fit(view); $.totable.focus(); }
	save();
}
for (const id of ['tq', 'tkind', 'tstate']) $[id].oninput = () => { most = 200; fillTable(); };
