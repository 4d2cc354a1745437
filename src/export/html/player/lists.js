// Lists beside the stage: each states how many entries it omits, and shows them on request.
const MANY = 50;
// The shape of an element: ellipse, box, line.
const shape = i => make('i', { className: i < 0 ? '' : 'is-' + whole.kind(i) });
// A button that selects an element, with a text about it.
const entry = (i, text, sign = '', time = '') => make('button', {
	className: sign, title: i < 0 ? text : whole.name(i),
	onclick: () => pick(i, 1),
}, shape(i), make('span', {}, time && make('b', { textContent: time + ' ' }), text));
function fill(id, all, row, most = MANY) {
	const list = $[id], kept = list.contains(document.activeElement);
	list.replaceChildren(...all.slice(0, most).map(row));
	if (all.length > most) {
		list.append(make('button', { className: 'more', textContent: `and ${all.length - most} more`, onclick: () => {
			fill(id, all, row, most * 4);
			list.children[most]?.focus();
		} }));
	}
	if (kept && !list.contains(document.activeElement)) $.title.focus({ preventScroll: true });
}
const signOf = i => range ? (([look]) => look == 'off' ? 'away' : KINDS.find(kind => look.endsWith(kind)) ?? '')(looksOf(whole)[i]) : base < 0 ? KINDS[whole.marks[whole.class(i, now)]] ?? (whole.isThere(i, now) ? '' : 'away') : whole.difference(i, base, now)[0] ?? '';
// An element with its rate, or with its difference.
function element(i) {
	const [, differs] = range ? NONE : base < 0 ? [0, whole.rateChange(i, now)] : whole.difference(i, base, now);
	const rate = differs || whole.rate(i, ...range ?? [now]);
	return entry(i, whole.name(i) + (rate ? '  ' + rate : ''), signOf(i));
}
const lastChange = (before = reported.findLast(([w]) => w < now)?.[3].at(-1)) => before ? `no change since ${before[5]}` : 'no change yet';
function listChanges() {
	$.fresh.hidden = base < 0 && !reported.length;
	if (base < 0) {
		setText('changestitle', data.sides ? 'Differences' : range ? 'Changes in these windows' : 'Changes in this window');
		const all = reported.filter(([w]) => range ? w >= range[0] && w <= range[1] : w == now);
		const lines = all.flatMap(([w]) => linesOf(w)), n = all.reduce((sum, [, n, , lines]) => sum + n - lines.length, lines.length);
		fill('changes', lines, ([, sign, i, text, id, when]) => {
			const line = entry(i, text, KINDS[sign], data.sides ? '' : when);
			if (id != null) line.dataset.entry = id;
			return line;
		});
		if (n > lines.length) $.changes.append(make('p', { textContent: `and ${n - lines.length} more` }));
		if (!n && !lines.length) $.changes.append(make('p', { textContent: lastChange() }));
		return;
	}
	setText('changestitle', `Differences from window ${base + 1}`);
	const all = marked(whole);
	fill('changes', all, element);
	if (!all.length) $.changes.append(make('p', { textContent: 'no difference' }));
}
onSeek.push(listChanges);
for (const [name, is] of [['quiet', !reported.length], ['single', !last]]) document.body.classList.toggle(name, is);

// Search: all words must be in name or type; `a -> b` finds connections. An exact last part comes first, then
// names that begin with the text, then names that contain it; without any, names with other separators, similar
// names, and names with the letters of each word in order.
function found(text) {
	const q = text.toLowerCase().trim();
	if (!q) return NONE;
	const ends = q.split(/\s*(?:->|→)\s*/), has = (name, part) => part.split(/\s+/).every(word => name.includes(word));
	const items = [...whole.names.keys()], lower = whole.names.map(name => name.toLowerCase()), parted = name => name.replace(/[\s/_-]+/g, ' ').trim();
	const rank = (i, q) => {
		const tail = lower[i].slice(lower[i].lastIndexOf('/') + 1);
		return lower[i] == q || tail == q ? 0 : tail.startsWith(q) ? 1 : tail.includes(q) ? 2 : has(lower[i], q) ? 3 : 4;
	};
	const sorted = (all, rank) => all.map(i => [rank(i), whole.name(i).length, i]).sort((a, b) => a[0] - b[0] || a[1] - b[1] || a[2] - b[2]).map(([, , i]) => i);
	if (ends.length > 1) {
		const all = [...Array(whole.count - whole.N).keys()].map(k => k + whole.N).filter(i => whole.ends(i).every((end, k) => has(lower[end], ends[k])));
		return sorted(all, i => whole.ends(i).reduce((sum, end, k) => sum + rank(end, ends[k]), 0));
	}
	const all = items.filter(i => has(lower[i] + ' ' + whole.type(i).slice(5).toLowerCase(), q));
	if (all.length || q.length < 3) return sorted(all, i => rank(i, q));
	const most = Math.min(2, Math.ceil(q.length / 4)), apart = i => Math.min(...[lower[i], ...lower[i].split('/')].map(part => distance(q, part)));
	const ways = [i => parted(q) && has(parted(lower[i]), parted(q)), i => apart(i) <= most, i => q.split(/\s+/).every(word => isInOrder(word, lower[i]))];
	return sorted(ways.map(way => items.filter(way)).find(some => some.length) ?? NONE, apart);
}
// The edit distance; two letters in the wrong order count once.
function distance(a, b) {
	if (Math.abs(a.length - b.length) > 2) return 9;
	let row = [...Array(b.length + 1).keys()], before = row;
	for (let i = 1; i <= a.length; i++) {
		const next = [i];
		for (let j = 1; j <= b.length; j++) {
			next[j] = Math.min(row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] != b[j - 1]));
			if (i > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) next[j] = Math.min(next[j], before[j - 2] + 1);
		}
		[before, row] = [row, next];
	}
	return row[b.length];
}
function isInOrder(q, name) {
	let at = 0;
	for (const c of name) if (c == q[at]) at++;
	return at == q.length;
}
let hitList = NONE;
function search() {
	const q = $.q.value;
	hitList = found(q);
	hits = q ? new Set(hitList.flatMap(i => whole.nearby(i))) : null;
	rings = new Set(hitList.flatMap(onStage));
	if (hits && shown == folded) hits = new Set(shown.members.flatMap((inside, i) => inside.some(h => hits.has(h)) ? i : NONE).concat([...Array(shown.count - shown.N).keys()].map(k => k + shown.N)));
	setText('count', q && (hitList.length ? `${hitList.length} found` : 'no matches'));
	$.onlybox.hidden = !q;
	fill('hits', hitList, element);
	redraw();
	drawRow();
	save();
}
function clearSearch() {
	$.q.value = '';
	only = $.only.checked = false;
	search();
}
$.q.oninput = search;
$.only.onchange = () => { only = $.only.checked; redraw(); };
// Namespaces, each with a checkbox that hides it.
function listSpaces() {
	const counts = new Map();
	for (const name of whole.names) counts.set(spaceOf(name), (counts.get(spaceOf(name)) ?? 0) + 1);
	$.spaces.hidden = counts.size < 2;
	$.spacelist.replaceChildren(...[...counts].sort().map(([space, n]) => make('label', {}, make('input', { type: 'checkbox', checked: !without.has(space), onchange: e => {
		without[e.target.checked ? 'delete' : 'add'](space);
		seek(now, 1);
		drawTime();
		save();
	} }), ` ${space == '/' ? 'no namespace' : space} (${n})`)));
}
// The nodes that are known beside topics; those without a name end with a question mark.
const named = isTopicTimeline ? [...whole.kinds.keys()].filter(i => !whole.kinds[i] && !/ \?( ×\d+)?$/.test(whole.names[i])) : NONE;
$.known.hidden = !named.length;
onSeek.push(() => $.known.hidden || fill('knownlist', named, element));
