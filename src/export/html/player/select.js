// The selection: its name, its evidence, its changes, and its connections.
// The elements on the stage that represent an element of the whole graph.
const onStage = i => i < 0 ? NONE : shown == whole ? [i] : [...shown.members.keys()].filter(k => shown.members[k].includes(i));
const nearOf = i => new Set(onStage(i).flatMap(k => shown.nearby(k)));
// The element of the whole graph for an element on the stage: the same one, or the first of its members.
const wholeOf = i => shown == whole ? i : i < shown.N ? whole.keys.get(shown.key(i)) ?? -1 : -1;
// Selects an element of the whole graph; `look` brings it into view, at the nearest time at which it exists unless the time
// was asked for, too.
function pick(i, look, isTimed) {
	if (i >= 0) leave();
	sel = i;
	group = -1;
	if (i >= 0 && look && !isTimed && !whole.isThere(i, now) && base < 0 && !range) toNearest(i);
	if (i < 0) viewBefore = null;
	else if (look) viewBefore ??= [shown, view];
	if (i >= 0 && look && shown == folded && !nearOf(i).size) show(whole);
	near = nearOf(i);
	redraw();
	card();
	drawTime();
	rowNames[rows.findIndex(([k]) => k >= 0 && k == i)]?.scrollIntoView({ block: 'nearest' });
	if (look && i >= 0) {
		bring(onStage(i), Math.max(scaleOf(view), TOPIC), 1.5);
	}
	if (i >= 0) showCard();
	save();
}
// Brings the card into view: on a phone it is below the stage.
function showCard() {
	if (isPhone()) return stage.scrollIntoView({ block: 'start' });
	if (!sideIsOpen()) choose(side, true);
	$.card.scrollIntoView({ block: 'nearest' });
}
// To the nearest window in which an element exists.
function toNearest(i) {
	for (let far = 1; far < W; far++) for (const w of [now - far, now + far]) {
		if (w >= 0 && w < W && whole.isThere(i, w)) {
			go(w);
			return setText('live', `${whole.name(i)} does not exist at that time; the nearest time is ${clock(starts[w])}`);
		}
	}
}
// A box of the picture that represents several elements: its members, and how to expand it.
let group = -1;
// The graph and the view before a selection, to which Escape returns unless the user moved since.
let viewBefore = null;
function restore() {
	const [g, box] = viewBefore ?? [shown, view];
	viewBefore = null;
	show(g);
	fit(box);
}
function pickGroup(i) {
	pick(-1);
	group = i;
	pin();
	showCard();
	save();
}
// In the picture, a group and its connections; when expanded, its members and their connections.
function pin() {
	near = new Set(shown == folded ? shown.nearby(group) : folded.members[group].flatMap(i => i < whole.N ? [i, ...whole.ends(i)] : i));
	redraw();
	card();
}
// Expands the group in place and brings its members into view, or collapses it again and restores the view.
function unfold() {
	if (shown == whole) {
		viewBefore ??= [folded, folded.home];
		restore();
		return pin();
	}
	const inside = folded.members[group].filter(i => i < whole.N);
	viewBefore = [folded, view];
	show(whole);
	bring(inside, 0);
	pin();
	setText('live', `${inside.length} elements, expanded`);
}
$.unfold.onclick = unfold;
const STATES = { active: 'active', silent: 'silent: running, no message in this window', latched: 'latched: its last message is still valid', declared: 'declared: known from a header only', off: 'not present in this window' }, NIL = '0 Hz';
const DEGREES = { stated: 'stated by a log, graph or file', inferred: 'inferred by a rule', declared: 'declared only' };
// The facts about an element in some windows, line by line.
function explain(g, i, [from, to] = range ?? [now, now]) {
	const isRange = from < to, look = g.class(i, from), [state, ...rest] = (isRange ? looksOf(g)[i][0] : g.there[look] || g.marks[look] == 1 ? g.classes[look] : 'off').split(' '), degree = rest.map(word => DEGREES[word]).find(Boolean) ?? 'measured';
	const turn = !isRange && g.rateChange(i, from), rate = g.rate(i, from, to), lifecycle = g.lifecycle(i, to), has = word => rest.includes(word);
	const now = [has('removed') ? 'ended in this window' : STATES[isRange && state == 'silent' && rate != NIL ? 'active' : state], has('added') && 'began in this window', turn && 'rate ' + turn, rate && (rate == NIL ? state == 'active' && 'no message in this window' : rate + ' in this window'), lifecycle && 'state ' + lifecycle, has('starved') && 'gets nothing (quality of service)', state != 'off' && degree];
	const text = now.filter(Boolean).join(' · ');
	return [`${g.kind(i) == 'edge' ? 'connection' : g.kind(i)} ${g.name(i)}`, isRange ? text.replaceAll('this window', 'this range') : text, ...g.facts[i]];
}
function card() {
	const g = group < 0 ? whole : folded, i = group < 0 ? sel : group;
	if ($.card.hidden = i < 0) return;
	const [title, state, ...facts] = explain(g, i), differs = base < 0 ? NONE : g.difference(i, base, now);
	setText('name', g.name(i));
	$.title.className = 'is-' + g.kind(i);
	setText('state', title.split(' ')[0] + ' · ' + state + (base < 0 ? '' : ` · compared with window ${base + 1}: ${differs[1] || differs[0] || 'the same'}`));
	// The members of a group are listed below.
	$.facts.replaceChildren(...facts.filter(fact => group < 0 || !/^\d+ together/.test(fact)).map(fact => make('p', { textContent: fact })));
	drawRate($.rate, g, i);
	$.rate.toggleAttribute('hidden', !$.rate.childElementCount);
	$.enlarge.hidden = $.rate.hasAttribute('hidden');
	if (!$.big.hidden) enlarge(true);
	$.unfold.hidden = group < 0;
	setText('unfold', shown == whole ? 'Collapse' : 'Expand');
	setText('endstitle', group < 0 ? 'Connected' : 'Members');
	const past = reported.flatMap(([w, , , lines]) => lines.filter(line => group < 0 ? line[2] == sel : folded.members[group].includes(line[2])).map(line => [w, ...line]));
	$.history.hidden = !past.length;
	fill('past', past, ([w, , sign, , text, , when]) => make('button', { className: KINDS[sign], onclick: () => go(w) }, make('b', { textContent: data.sides ? '' : when + ' ' }), text), 12);
	fill('ends', group < 0 ? whole.ends(sel) : folded.members[group], element);
	const [isOver, signs] = group < 0 ? why(sel) : [0, NONE];
	$.signsof.hidden = !signs.length;
	setText('whytitle', isOver ? 'Why?' : 'Last signs');
	fill('why', signs, ([s, text, k = -1]) => make('button', { className: k < 0 ? '' : 'removed', onclick: () => { visit(windowAt(s)); if (k >= 0) pick(k, 1, 1); } }, make('span', {}, make('b', { textContent: clock(Math.floor(s * 10) / 10) + ' ' }), text)));
}
// The last message and log texts of a node in its lifetime in this window, or in the one before; and if it ended, what else
// stopped within a second, and what lost its only publisher. Each with its time, and its element.
function why(i) {
	const own = data.lives.flatMap(([k, lives]) => k == i ? lives : NONE), until = ends[range?.[1] ?? now];
	const life = own.findLast(([from]) => from < until) ?? own[0];
	if (!life) return [0, NONE];
	const [, end, message, texts] = life, isOver = end < total - .01, w = windowAt(end), all = whole.arrows.map((arrow, k) => [...arrow, whole.N + k]);
	const stops = reported.flatMap(([, , , lines]) => lines).filter(([s, sign, k]) => sign == 1 && k != i && Math.abs(s - end) <= 1);
	const lost = all.filter(([a, b, , k]) => a == i && whole.kinds[b] % 3 && whole.class(k, w) && !all.some(([, c, , k]) => c == b && whole.isThere(k, w)));
	const after = [...stops.map(([s, , k, text]) => [s, text.split(':')[0], k]), ...lost.map(([, b]) => [end, whole.name(b) + ' lost its only publisher', b])];
	return [isOver, [...message ? [[message[0], 'last message, on ' + message[1]]] : NONE, ...texts.map(([s, text]) => [s, `“${text}”`]).reverse(), ...isOver ? after : NONE]];
}
// The rate of an element in each window, with axes; empty if it has none.
function drawRate(svg, g, i, w = 300, h = 84) {
	const rates = starts.map((_, k) => g.hz(i, k)), most = Math.max(...rates), step = roundStep(most / (h < 150 ? 2 : 5)), top = Math.ceil(most / step) * step;
	const deep = 16, left = 50, right = w - 4, x = s => left + s / total * (right - left), y = hz => h - deep - hz / top * (h - deep - 8);
	set(svg, { viewBox: `0 0 ${w} ${h}`, 'aria-label': `Rate of ${g.name(i)}, at most ${withUnit(most)}` });
	if (!(most > 0)) return svg.replaceChildren();
	const from = range?.[0] ?? now, to = range?.[1] ?? now;
	const line = rates.map((hz, k) => `${k ? 'L' : 'M'}${x(starts[k]).toFixed(1)} ${y(hz).toFixed(1)}H${x(ends[k]).toFixed(1)}`).join('');
	const times = ticksOf(right - left), last = times.length - 1;
	svg.replaceChildren(
		drawn('rect', { class: 'now', x: x(starts[from]), y: 8, width: Math.max(2, x(ends[to]) - x(starts[from])), height: h - deep - 8 }),
		...multiples(step, top).flatMap(hz => [drawn('path', { class: 'grid', d: `M${left} ${y(hz)}H${right}` }), drawn('text', { x: left - 5, y: y(hz) + 4, 'text-anchor': 'end' }, withUnit(hz))]),
		drawn('path', { class: 'line', d: line }),
		...times.flatMap(([s, text], k) => [drawn('path', { class: 'grid', d: `M${x(s)} ${h - deep}v4` }), drawn('text', { x: x(s), y: h - 1, 'text-anchor': ['start', 'middle', 'end'][k && 1 + (k == last)] }, text)]));
}
// The same plot in the size of the stage.
function enlarge(on) {
	const g = group < 0 ? whole : folded, i = group < 0 ? sel : group;
	on &&= i >= 0;
	$.big.hidden = !on;
	if (!on) return $.enlarge.focus();
	setText('bigname', g.name(i));
	drawRate($.bigplot, g, i, Math.max(500, $.big.clientWidth - 24), Math.max(200, $.big.clientHeight - 70));
}
$.enlarge.onclick = () => enlarge(true);
onSeek.push(card);

// The element under the pointer.
function hover(e, [title, ...lines]) {
	$.tip.replaceChildren(make('b', { textContent: title }), ...lines.filter(Boolean).map(line => make('div', { textContent: line })));
	$.tip.hidden = false;
	const { clientWidth: w, clientHeight: h } = document.documentElement, box = $.tip.getBoundingClientRect();
	$.tip.style.left = Math.max(4, Math.min(e.clientX + 14, w - box.width - 6)) + 'px';
	$.tip.style.top = (e.clientY + 18 + box.height < h ? e.clientY + 18 : Math.max(4, e.clientY - box.height - 12)) + 'px';
}
const elementAt = e => shown.dom.get(e.target.closest?.('.items > g, .arrows > g')) ?? -1;
stage.addEventListener('pointermove', e => {
	const i = e.pointerType == 'touch' || e.buttons ? -1 : elementAt(e);
	if (i < 0) $.tip.hidden = true;
	else hover(e, explain(shown, i).slice(0, 2));
});
for (const event of ['pointerleave', 'pointerdown']) stage.addEventListener(event, () => { $.tip.hidden = true; });
for (const g of [whole, folded]) if (g?.svg) g.svg.onclick = e => {
	if (far > 5) return;
	const i = elementAt(e), same = i < 0 ? -1 : wholeOf(i);
	if (i >= 0 && same < 0 && shown == folded && i < shown.N) pickGroup(i);
	else pick(same);
};

