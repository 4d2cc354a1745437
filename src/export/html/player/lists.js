// Lists beside the stage: each tells how much it leaves out, and shows it.
const MANY = 50;
// The shape of an element: ellipse, box, line.
const shape = i => make('i', { className: i < 0 ? '' : 'is-' + whole.kind(i) });
// A button that picks an element, with what is to be said of it.
const entry = (i, text, sign = '', time = '') => make('button', {
	className: sign, title: i < 0 ? text : whole.name(i),
	onclick: () => pick(i, 1, 1),
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
const signOf = i => base < 0 ? KINDS[whole.marks[whole.class(i, now)]] ?? (whole.isThere(i, now) ? '' : 'away') : whole.difference(i, base, now)[0] ?? '';
// An element with its rate, or with how it differs.
function element(i) {
	const [, differs] = base < 0 ? [0, whole.turn(i, now)] : whole.difference(i, base, now);
	const rate = differs || whole.rate(i, now);
	return entry(i, whole.name(i) + (rate ? '  ' + rate.replace(/^.* over /, '') : ''), signOf(i));
}
function listNews() {
	if (base < 0) {
		say('newstitle', data.sides ? 'What differs' : 'Changes in this window');
		const { n = 0, lines = [] } = news.get(now) ?? {};
		// Nothing, as before.
		if (!n && $.news.firstChild?.textContent == 'None.') return;
		fill('news', lines, ([s, sign, i, text, id]) => {
			const line = entry(i, text, KINDS[sign], data.sides ? '' : clock(Math.floor(s)));
			line.dataset.entry = id;
			return line;
		});
		if (n > lines.length) $.news.append(make('p', { textContent: `and ${n - lines.length} more` }));
		if (!n) $.news.append(make('p', { textContent: 'None.' }));
		return;
	}
	say('newstitle', `What differs from window ${base + 1}`);
	const all = marked(whole);
	fill('news', all, element);
	if (!all.length) $.news.append(make('p', { textContent: 'Nothing.' }));
}
onSeek.push(listNews);

// Search: all words must be in name or type; `a -> b` finds connections.
function found(text) {
	const q = text.toLowerCase().trim();
	if (!q) return NONE;
	const ends = q.split(/\s*(?:->|→)\s*/), all = [], has = (name, part) => part.split(/\s+/).every(word => name.includes(word));
	for (let i = 0; i < whole.count; i++) {
		if (ends.length > 1) {
			if (i < whole.N) continue;
			const [a, b] = whole.ends(i).map(end => whole.names[end].toLowerCase());
			if (has(a, ends[0]) && has(b, ends[1])) all.push(i);
		} else if (i < whole.N && has((whole.names[i] + ' ' + whole.type(i).slice(5)).toLowerCase(), q)) all.push(i);
	}
	return all;
}
let hitList = NONE;
function search() {
	const q = $.q.value;
	hitList = found(q);
	hits = q ? new Set(hitList.flatMap(i => [i, ...(i < whole.N ? whole.ends(i) : whole.ends(i))])) : null;
	if (hits) for (const i of hitList) if (i < whole.N) for (const k of whole.ends(i)) whole.ends(k).forEach(end => hits.add(end));
	if (hits && shown == folded) hits = new Set(shown.holds.flatMap((held, i) => held.some(h => hits.has(h)) ? i : NONE).concat([...Array(shown.count - shown.N).keys()].map(k => k + shown.N)));
	say('count', q && (hitList.length ? `${hitList.length} found` : 'nothing found'));
	$.onlybox.hidden = !q;
	fill('hits', hitList, element);
	dress();
	save();
}
function clearSearch() {
	$.q.value = '';
	only = $.only.checked = false;
	search();
}
$.q.oninput = search;
$.only.onchange = () => { only = $.only.checked; dress(); };
