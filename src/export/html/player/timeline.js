// The timeline: phases, changes and lifelines at their exact times, and the playhead over the current window.
// The visible stretch of the time, and a time as a share of it.
let stretch = [0, long];
const part = s => (s - stretch[0]) / (stretch[1] - stretch[0]);
const lay = (element, from, to, least = 0) => {
	element.style.left = 100 * part(from) + '%';
	element.style.width = `max(${least}px, ${100 * (part(to) - part(from))}%)`;
};
function showTime(left, length) {
	length = Math.min(long, Math.max(long / 1e3, length));
	left = Math.max(0, Math.min(long - length, left));
	stretch = [left, left + length];
	drawTime();
}
// Zooms the time around a moment.
function zoomTime(by, s = starts[now]) {
	const [from, to] = stretch;
	showTime(s - (s - from) * by, (to - from) * by);
}
// The height of a row, whether its name is shown, and whether rows without events are folded.
let rowHeight = 14, hasNames = true, isFolded = false, showsAll = false, beforePrint;
const bands = phases.map(([from, to, name], p) => make('button', { textContent: `${p + 1} · ${name}`, title: `phase ${p + 1}: ${name}, ${clock(from)} – ${clock(to)}`, onclick: () => visit(windowAt(from)) }));
$.band.append(...bands);
$.time.classList.toggle('nophases', !phases.length);
// A row of the topic timeline also shows the type and the rate.
const rowNames = rows.map(([i, label, inside]) => i < 0
	? make('div', { className: inside ? 'inside' : 'space', textContent: label, title: label })
	: make('button', { className: inside ? 'inside' : '', title: whole.name(i), onclick: () => pick(i, 1) },
		...isTopicTimeline ? [make('span', { textContent: label }), make('span', { className: 'type', textContent: whole.type(i).slice(5), title: whole.type(i) }), make('span', { className: 'hz' })] : [label]));
const quiet = rows.map(([i, , , , , events], r) => i >= 0 && !events.length && !takeovers.some(([, a, b]) => a == r || b == r));
const folder = make('button', { className: 'more', onclick: () => { showsAll = !showsAll; drawTime(); } });
$.rownames.append(...rowNames, ...isTopicTimeline ? [] : [folder]);
const showRates = () => isTopicTimeline && rows.forEach(([i], r) => {
	if (i >= 0) rowNames[r].lastChild.textContent = whole.rate(i, ...range ?? [now]) || '–';
});
onSeek.push(showRates);
// The position of each row; rows of hidden namespaces have none.
const isRowOut = ([i, , inside], r) => i >= 0 ? isOut(whole, i) || isFolded && quiet[r] && i != sel : isTitleOut(r);
// A title without any rows below it is hidden, too.
function isTitleOut(r) {
	let k = r + 1;
	while (k < rows.length && rows[k][2] && isRowOut(rows[k], k)) k++;
	return k > r + 1 && !rows[k]?.[2];
}
let placeOf = [];

const rectangle = (x, y, w, h) => `M${x.toFixed(1)} ${y.toFixed(1)}h${w.toFixed(1)}v${h.toFixed(1)}h${(-w).toFixed(1)}z`;
// A mark with the log events that it represents.
const markOf = ([className, ids, d]) => drawn('path', { class: className, d, [String(ids).includes(' ') ? 'data-entries' : 'data-entry']: ids });
// The paths of a row around some height: its lifetimes, its bars, and its events.
function pathsOf([, , , lifetimes, bars, events], y, x) {
	const d = { lifetime: '', inferred: '', bar: '' }, tall = rowHeight * .8, sign = Math.min(tall, 13);
	for (let k = 0; k < lifetimes.length; k += 3) d[lifetimes[k + 2] ? 'inferred' : 'lifetime'] += `M${x(lifetimes[k]).toFixed(1)} ${y}H${x(lifetimes[k + 1]).toFixed(1)}`;
	for (let k = 0; k < bars.length; k += 3) {
		const h = rowHeight * (isTopicTimeline ? .1 * bars[k + 2] : .16 + .06 * bars[k + 2]);
		d.bar += rectangle(x(bars[k]), isTopicTimeline ? y + tall / 2 - h : y - h / 2, Math.max(.6, x(bars[k + 1]) - x(bars[k])), h);
	}
	return [d, events.map(([s, kind, id]) => markOf([['start', 'end', 'event'][kind], id, [
		`M${x(s).toFixed(1)} ${y - tall / 2}v${tall}`,
		`M${(x(s) - sign / 3).toFixed(1)} ${y - sign / 3}l${sign / 1.5} ${sign / 1.5}m0 ${-sign / 1.5}l${-sign / 1.5} ${sign / 1.5}`,
		`M${(x(s) - sign / 4).toFixed(1)} ${y}l${sign / 4} ${-sign / 4}l${sign / 4} ${sign / 4}l${-sign / 4} ${sign / 4}z`][kind]]))];
}
// Draws everything in the available pixels.
function drawTime() {
	const small = !isTopicTimeline && ($.controls.classList.contains('small') || isPhone()), wide = $.axis.clientWidth, x = s => part(s) * wide;
	// Rows without events are folded if not all have space, since those with events tell the mission.
	const most = small ? 5 : isTopicTimeline ? 56 : 14, least = small ? 2 : isTopicTimeline ? 20 : 9;
	const room = small ? 48 : isTopicTimeline ? $.controls.clientHeight - $.buttons.offsetHeight - 110 : innerHeight * (innerHeight < 800 ? .2 : .3);
	const isTight = !isTopicTimeline && rows.some(([i], r) => i >= 0 && !quiet[r]) && rows.filter(([i]) => i < 0 || !isOut(whole, i)).length * (small ? 3 : least) > room;
	let count = 0;
	isFolded = isTight && (small || !showsAll);
	placeOf = rows.map((row, r) => isRowOut(row, r) ? -1 : count++);
	folder.textContent = isFolded ? `${rows.filter((row, r) => quiet[r] && placeOf[r] < 0).length} more, without events` : 'Only rows with events';
	folder.hidden = !isTight || small || !quiet.some(Boolean);
	hasNames = !small;
	rowHeight = Math.max(least, Math.min(most, Math.floor(room / (count + !folder.hidden))));
	$.time.style.setProperty('--row', rowHeight + 'px');
	rowNames.forEach((name, r) => { name.hidden = placeOf[r] < 0; });
	const high = rowHeight * count, drawing = { lifetime: '', inferred: '', bar: '' }, signs = [];
	rows.forEach((row, r) => {
		if (placeOf[r] < 0) return;
		const [d, own] = pathsOf(row, (placeOf[r] + .5) * rowHeight, x);
		for (const key in d) drawing[key] += d[key];
		signs.push(...own);
	});
	for (const [s, a, b, id] of takeovers) {
		if (placeOf[a] < 0 || placeOf[b] < 0) continue;
		const [from, to] = [a, b].map(r => (placeOf[r] + .5) * rowHeight), tip = Math.sign(to - from) * 4;
		signs.push(markOf(['takeover', id, `M${x(s)} ${from}V${to}m-3 ${-tip}l3 ${tip}l3 ${-tip}M${x(s) - 2} ${from}a2 2 0 1 0 4 0a2 2 0 1 0 -4 0`]));
	}
	set($.plot, { width: wide, height: high + (folder.hidden ? 0 : rowHeight) });
	for (const key in drawing) $.plot.querySelector('.' + key).setAttribute('d', drawing[key]);
	$.plot.querySelector('.events').replaceChildren(...signs);
	bands.forEach((button, p) => lay(button, phases[p][0], phases[p][1]));
	if (!data.sides) drawMarks(x);
	drawTicks(wide);
	drawRow();
	drawHead();
}
// A plus above, a diamond in the middle, a minus below; overlapping marks are merged.
function drawMarks(x) {
	const all = [], last = [];
	for (const [, , , lines] of reported) for (const [s, sign, , , id] of lines) {
		const at = x(s);
		if (last[sign] && at - last[sign].at < 6) last[sign].ids += ' ' + id;
		else all.push(last[sign] = { at, sign, ids: String(id) });
	}
	$.marks.replaceChildren(...all.map(({ at, sign, ids }) =>
		markOf([KINDS[sign], ids, [`M${at - 3} 5h6m-3 -3v6`, `M${at - 3} 21h6`, `M${at} 9.5l3.5 3.5l-3.5 3.5l-3.5 -3.5z`][sign]])));
}
// The smallest of 1, 2, 5, 10, 20 … that is at least this.
function roundStep(least) {
	const ten = 10 ** Math.floor(Math.log10(least));
	return [1, 2, 5, 10].map(k => k * ten).find(step => step >= least * (1 - 1e-9));
}
const multiples = (step, most) => Array.from({ length: Math.floor(most / step + 1e-6) + 1 }, (_, k) => +(k * step).toPrecision(9));
const STEPS = [10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400];
// Round times on an axis of some width, and its end: each with its text.
function ticksOf(width, start = 0, end = total) {
	const least = (end - start) * 70 / width, step = least <= 5 ? roundStep(least) : STEPS.find(s => s >= least) ?? Math.ceil(least / 86400) * 86400;
	const text = s => iso(s, s < 3600 ? 14 : 11, s % 1 ? 23 : 19), room = (7 * text(end).length + 46) * (end - start) / width;
	return [...multiples(step, end).filter(s => s >= start && s < end - room), end].map(s => [s, text(s)]);
}
function drawTicks(wide) {
	const all = ticksOf(wide, ...stretch);
	$.ticks.replaceChildren(...all.map(([s, text], k) => {
		const tick = make('span', { textContent: text, className: k == all.length - 1 ? 'last' : '' });
		if (!tick.className) tick.style.left = 100 * part(s) + '%';
		return tick;
	}));
}
function drawHead() {
	// The visible stretch follows the window.
	if (!data.sides && (ends[now] < stretch[0] || starts[now] > stretch[1])) return showTime(starts[now] - (stretch[1] - stretch[0]) / 10, stretch[1] - stretch[0]);
	for (const [id, from, to] of [['head', ...range ?? [now, now]], ['base', base, base]]) {
		$[id].hidden = from < 0 || !!data.sides;
		if ($[id].hidden) continue;
		lay($[id], starts[from], ends[to], 3);
	}
}
function drawRow() {
	const r = rows.findIndex(([i]) => i >= 0 && i == sel), rect = $.plot.firstElementChild;
	rowNames.forEach((name, k) => {
		name.classList.toggle('picked', k == r);
		name.classList.toggle('ring', hitList.includes(rows[k][0]));
	});
	set(rect, { x: 0, y: placeOf[r] * rowHeight || 0, width: r < 0 ? 0 : $.axis.clientWidth, height: rowHeight });
}
onSeek.push(drawHead);

// A click seeks; near a mark it goes to exactly that change; on a row it selects the element. Dragging the
// frame moves it; dragging elsewhere selects a range: what the pointer passed over is shaded, and the frame surrounds the windows that it
// touches, since rates are only known per window.
const timeAt = e => stretch[0] + (e.clientX - $.axis.getBoundingClientRect().left) / $.axis.clientWidth * (stretch[1] - stretch[0]);
function markAt(e) {
	const s = timeAt(e);
	let best = -1, least = 7 / $.axis.clientWidth * (stretch[1] - stretch[0]);
	for (const [w, , , lines] of reported) for (const [time] of lines) if (Math.abs(time - s) < least) { least = Math.abs(time - s); best = w; }
	return best;
}
const rowAt = e => !hasNames ? -1 : rows[placeOf.indexOf(Math.floor((e.clientY - $.plot.getBoundingClientRect().top) / rowHeight))]?.[0] ?? -1;
let moved = 0, grip = 0, pressed = 0, first = -1;
$.axis.onpointerdown = e => {
	if (e.target.closest('#band button') || e.button) return;
	moved = 0;
	if (e.isTrusted) $.axis.setPointerCapture(e.pointerId);
	if (data.sides) return;
	const w = e.target.closest('#marks') ? markAt(e) : -1, s = timeAt(e);
	const [from, to] = range ?? [now, now], inside = !range && s >= starts[from] && s < ends[to];
	// The frame keeps its offset to the pointer.
	grip = s - starts[now];
	pressed = s;
	first = inside && e.pointerType != 'touch' ? -1 : windowAt(s);
	anchor = -1;
	if (w >= 0) visit(w);
	else if (!inside || range) go(windowAt(s));
};
$.axis.onpointermove = e => {
	if (e.buttons && $.axis.hasPointerCapture(e.pointerId)) {
		moved += Math.abs(e.movementX);
		if (moved < 6 || data.sides) return;
		const s = timeAt(e), w = windowAt(Math.max(0, first < 0 ? s - grip + 1e-3 : s));
		if (first < 0) return w == now || go(w);
		$.passed.hidden = false;
		lay($.passed, Math.max(0, Math.min(s, pressed)), Math.min(total, Math.max(s, pressed)));
		if (w != now || !range) {
			span([first, w]);
			seek(w, 1);
		}
		const n = range[1] - range[0] + 1;
		return hover(e, [rangeTimes(), n > 1 ? n + ' whole windows' : 'one whole window']);
	}
	const i = e.target.closest('#lifelines') ? rowAt(e) : -1, w = e.target.closest('#marks') ? markAt(e) : -1;
	if (i >= 0) {
		const s = timeAt(e), [title, state] = explain(whole, i, [windowAt(s), windowAt(s)]);
		hover(e, [title, `${clock(Math.floor(s))} · ${state}`]);
	}
	else if (w >= 0) hover(e, [`${clock(starts[w])} – ${clock(ends[w])}`, ...headlines.get(w).lines.slice(0, 8).map(line => line[3])]);
	else $.tip.hidden = true;
};
$.axis.onpointerup = e => {
	const i = e.target.closest('#axis') && document.elementsFromPoint(e.clientX, e.clientY).includes($.lifelines) ? rowAt(e) : -1;
	if (i >= 0 && moved < 6) pick(i, 1, 1);
	$.passed.hidden = $.tip.hidden = true;
	save();
};
$.axis.addEventListener('wheel', e => {
	const [from, to] = stretch;
	if (e.ctrlKey) zoomTime(Math.exp(e.deltaY * .004), timeAt(e));
	else if (e.deltaX) showTime(from + e.deltaX / $.axis.clientWidth * (to - from), to - from);
	else return;
	e.preventDefault();
}, { passive: false });
$.axis.onpointerleave = () => { $.tip.hidden = true; };
$.lifelines.onscroll = () => { $.rownames.scrollTop = $.lifelines.scrollTop; };
$.rownames.onscroll = () => { $.lifelines.scrollTop = $.rownames.scrollTop; };
$.seek.oninput = () => go(+$.seek.value);
