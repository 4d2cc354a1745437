// The look of a window: classes, rates, header. `shown` is the graph on the stage, `base` the window for
// comparison.
let now = 0, base = -1, shown = folded ?? whole, sel = -1, timer = 0, hits = null;
let near = new Set(), rings = new Set(), only = false, looping = false;
// A range of windows shown as one: its ends, the window at which it began, and its looks, per graph.
let range = null, anchor = -1, rangeLooks = new Map();
// The range that is played again and again.
let played = null;
// Namespaces that the user hid.
const without = new Set();
const spaceOf = name => name.startsWith('/') && name.indexOf('/', 1) > 0 ? name.slice(0, name.indexOf('/', 1)) : '/';
const isOut = (g, i) => without.size > 0 && (i < g.N ? [i] : g.ends(i)).some(k => without.has(spaceOf(g.names[k])) || without.has(g.names[k]));
const onSeek = [], stage = $.stage;
const calm = matchMedia('(prefers-reduced-motion)');

// Class and rate of every element over the range: all that existed at any time, marked if the end differs
// from the beginning.
function looksOf(g) {
	if (rangeLooks.has(g)) return rangeLooks.get(g);
	const [from, to] = range, looks = [];
	for (let i = 0; i < g.count; i++) {
		const list = g.runs[i][0], first = g.class(i, from), after = g.isThere(i, to);
		let last = -1;
		for (let p = Math.max(0, place(list, from) - 2); p < list.length && list[p] <= to; p += 2) {
			if (list[p + 1]) last = list[p + 1];
		}
		// Elements that begin in the first window did not exist before it; class 0 means absent.
		const was = first > 0 && g.marks[first] != 0, mark = was == after ? '' : after ? ' added' : ' removed';
		looks.push(last < 0 ? ['off', ''] : [g.plain[last] + mark, g.rate(i, from, to)]);
	}
	rangeLooks.set(g, looks);
	return looks;
}
const spell = hz => hz >= 99.95 ? hz.toFixed(0) : hz >= .95 ? +hz.toFixed(1) + '' : hz ? +hz.toPrecision(2) + '' : '0';
const withUnit = hz => hz < 999.5 ? spell(hz) + ' Hz' : spell(hz / 1e3) + ' kHz';
// Shows a range of windows as one graph; `null` shows single windows again.
function span(ends) {
	range = ends && [Math.min(...ends), Math.max(...ends)];
	if (!range) anchor = -1;
	rangeLooks = new Map();
}
function classOf(g, i, w) {
	if (range) return looksOf(g)[i][0];
	const k = g.class(i, w);
	if (base < 0) return g.classes[k];
	const [difference] = g.difference(i, base, w);
	if (difference == 'removed') return g.plain[g.class(i, base)] + ' removed';
	return (g.there[k] ? g.plain[k] : 'off') + (difference ? ' ' + difference : '');
}
function labelOf(g, i, w) {
	const topic = i >= g.N && g.arrows[i - g.N][2], named = text => (topic ? topic + ' ' : '') + (text == NIL ? '' : text);
	if (range) return named(looksOf(g)[i][1]);
	if (base >= 0) return named(g.difference(i, base, w)[1] ?? g.rate(i, w));
	const lifecycle = g.runs[i][2].length && g.lifecycle(i, w), turn = g.rateChange(i, w);
	return lifecycle || turn && named(turn) || g.labels[at(g.runs[i][1], w)];
}
// Updates the elements of the stage to the current window; returns those that look different.
function redraw() {
	const g = shown, moved = [];
	g.els.forEach((e, i) => {
		const look = classOf(g, i, now) + (isOut(g, i) ? ' without' : ''), all = look + (near.has(i) ? ' near' : '') + (hits?.has(i) ? ' hit' : '') + (rings.has(i) ? ' ring' : '');
		if (all != g.cur[i]) {
			if (look != g.cur[i].replace(/ (near|hit|ring)\b/g, '')) moved.push(i);
			e.setAttribute('class', g.base[i] + (g.cur[i] = all));
		}
		const text = g.live[i];
		if (look == 'off' || !text) return;
		const label = labelOf(g, i, now);
		if (text.shown != label) text.textContent = text.shown = label;
	});
	g.spaces.forEach(([frame, inside]) => frame.classList.toggle('without', inside.every(i => /^off|without/.test(g.cur[i]))));
	g.svg?.classList.toggle('filtered', only && !!hits);
	g.svg?.classList.toggle('pinned', near.size > 0);
	return moved;
}
// The elements that are marked in the current window, or differ from the base.
function marked(g = shown) {
	const isMarked = i => range ? /added|removed/.test(looksOf(g)[i][0]) : base < 0 ? g.marks[g.class(i, now)] >= 0 : g.difference(i, base, now).length;
	return [...Array(g.count).keys()].filter(i => isMarked(i) && !isOut(g, i));
}
// The headlines of a window about elements that are not hidden.
const linesOf = w => (headlines.get(w)?.lines ?? NONE).filter(line => line[2] < 0 || !isOut(whole, line[2]));
function countsOf() {
	if (base < 0 && !range) {
		const all = linesOf(now), n = [0, 1, 2].map(sign => all.filter(line => line[1] == sign).length);
		return all.length == headlines.get(now)?.lines.length ? headlines.get(now).counts : n.map((n, k) => n && ['+' + n, '−' + n, n + ' changed'][k]).map(text => text || '');
	}
	const sum = { added: [0, 0, 0], removed: [0, 0, 0], changed: [0, 0, 0] };
	marked(whole).forEach(i => sum[range ? looksOf(whole)[i][0].split(' ').at(-1) : whole.difference(i, base, now)[0].split(' ')[0]][i < whole.N ? +(whole.kinds[i] % 3 > 0) : 2]++);
	const spell = (sign, counts) => counts.map((n, k) => n && `${sign}${n} ${['node', 'topic', 'edge'][k]}${n > 1 ? 's' : ''}`).filter(Boolean).join(' ');
	return [spell('+', sum.added), spell('−', sum.removed), spell('', sum.changed) && spell('', sum.changed) + ' changed'];
}
function seek(w, quiet) {
	w = Math.max(0, Math.min(last, w));
	const step = (w - now) ** 2;
	now = w;
	const moved = redraw();
	if (step == 1 && moved.length < 41 && !calm.matches) moved.forEach(i => shown.els[i].animate({ opacity: [.2, 1] }, 250));
	header();
	onSeek.forEach(update => update());
	if (quiet) return;
	const lines = linesOf(now);
	setText('live', [clock(starts[now]), `window ${now + 1} of ${W}`, ...lines.slice(0, 5).map(line => line[3])].join(', '));
	save();
}
const rangeTimes = () => `${clock(starts[range[0]])} – ${clock(ends[range[1]])}`;
function header() {
	const place = `window ${now + 1} of ${W}`, counts = countsOf();
	if (range) setText('where', `windows ${range[0] + 1} to ${range[1] + 1} of ${W} · ${rangeTimes()} of ${clock(total)} · rates over the range`);
	else setText('where', data.sides?.[now] ?? `${place} · ${clock(starts[now])} – ${clock(ends[now])} of ${clock(total)}${base < 0 ? '' : ` · compared with window ${base + 1}, ${clock(starts[base])} – ${clock(ends[base])}`}`);
	$.clock.firstChild.textContent = iso(data.epoch / 1e3 + starts[now], 11, 19) + ' ';
	const p = phases.findLastIndex(([from]) => from < ends[now]);
	setText('phase', p < 0 ? '' : `phase ${p + 1}: ${phases[p][2]}`);
	setText('headline', base < 0 && !range && !without.size && headlines.get(now)?.words || lastChange());
	// The log events that the badges count; a difference between two arbitrary windows need not be an event.
	if (base < 0 && !range) $.counts.dataset.entries = linesOf(now).flatMap(line => line[4] ?? NONE).join(' ');
	else delete $.counts.dataset.entries;
	$.counts.dataset.of = range ? 'this range' : base < 0 ? data.sides ? '' : 'this window' : 'compared';
	$.counts.replaceChildren(...counts.flatMap((text, m) => text ? [make('span', { className: KINDS[m], textContent: text })] : []));
	$.seek.value = now;
	$.seek.ariaValueText = [clock(starts[now]), place, ...counts.filter(Boolean)].join(', ');
}
// Multiples of real time, from a window in ten seconds to sixty in a second, about two windows in a second first; and a
// window with changes every second.
const speeds = [...Array(21).keys()].map(k => [1, 2, 5][k % 3] * 10 ** Math.floor(k / 3)).filter(by => by * W / total <= 60 && by * W / total >= .1);
$.speed.append(...[...speeds, 0].map(by => make('option', { value: by, textContent: by ? by + ' ×' : 'changes' })));
$.speed.value = speeds.findLast(by => by * W / total < 2.6) ?? speeds[0] ?? 0;
// Plays the mission, or the range again and again.
function play(on) {
	if (!on && !timer) return;
	cancelAnimationFrame(timer);
	timer = 0;
	setText('play', on ? 'Pause' : 'Play');
	if (!on) {
		if (played) span(played);
		$.passed.hidden = true;
		played = null;
		seek(now, 1);
		return save();
	}
	played = range;
	span(null);
	const [first, end] = played ?? [0, last];
	if (played) lay($.passed, starts[first], ends[end]);
	$.passed.hidden = !played;
	if (played || now == last) seek(first, 1);
	let before, s = starts[now];
	const step = t => {
		const speed = +$.speed.value, gone = (t - (before ??= t)) / 1e3;
		let w = now;
		if (speed) {
			s += Math.min(gone, .5) * speed;
			before = t;
			w = s < ends[end] ? Math.max(now, windowAt(s)) : end + 1;
		} else if (gone >= 1) {
			before = t;
			do w++; while (w <= end && !headlines.has(w));
		}
		if (w > end) {
			if (!played && !looping) return play(0);
			w = first;
		}
		if (w != now) {
			if (w == first || !speed) s = starts[w];
			seek(w, 1);
			if (!speed) look();
		}
		timer = requestAnimationFrame(step);
	};
	timer = requestAnimationFrame(step);
}
function go(w) {
	play(0);
	w = Math.max(0, Math.min(last, w));
	span(anchor < 0 ? null : [anchor, w]);
	seek(w);
}
// Goes to a window for its changes, and brings them into view.
const visit = w => { leave(); go(w); look(); };
// To the next window with a headline.
function jump(by) {
	let w = now;
	do w += by; while (w >= 0 && w < W && !headlines.has(w));
	if (w >= 0 && w < W) visit(w);
	else { play(0); setText('live', by > 0 ? 'No later change' : 'No earlier change'); }
}
function compare(w) {
	if (w >= 0) span(null);
	base = w;
	$.compare.ariaPressed = base >= 0;
	setText('compare', base < 0 ? 'Compare' : 'Stop comparing');
	seek(now);
}
// Shows another graph on the stage.
function show(g) {
	if (g == shown || !g) return;
	shown.svg.setAttribute('hidden', '');
	shown = g;
	shown.svg.removeAttribute('hidden');
	setText('open', shown == folded ? 'Expand all' : 'Collapse');
	near = nearOf(sel);
	redraw();
	fit(shown.home);
}
