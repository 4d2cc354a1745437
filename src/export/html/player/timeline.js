// The timeline: phases, changes and lifelines at their exact times, and the playhead over the current window.
const ROW = isBoard ? 20 : 14, part = s => s / long, percent = s => 100 * part(s) + '%';
let pitch = ROW, beforePrint;
phases.forEach(([from, to, name], p) => {
	const button = make('button', { textContent: `${p + 1} · ${name}`, title: `phase ${p + 1}: ${name}, ${clock(from)} – ${clock(to)}`, onclick: () => go(windowAt(from)) });
	button.style.left = percent(from);
	button.style.width = percent(to - from);
	$.band.append(button);
});
$.time.classList.toggle('nophases', !phases.length);
// A row of the topic timeline also shows the type and the rate.
const rowNames = rows.map(([i, label, inside]) => i < 0
	? make('div', { className: inside ? 'inside' : 'space', textContent: label, title: label })
	: make('button', { className: inside ? 'inside' : '', title: whole.name(i), onclick: () => pick(i, 1) },
		...isBoard ? [make('span', { textContent: label }), make('span', { className: 'type', textContent: whole.type(i).slice(5), title: whole.type(i) }), make('span', { className: 'hz' })] : [label]));
$.rownames.append(...rowNames);
const tellRates = () => isBoard && rows.forEach(([i], r) => {
	if (i >= 0) rowNames[r].lastChild.textContent = whole.rate(i, ...range ?? [now]) || '–';
});
onSeek.push(tellRates);
// The position of each row; rows of hidden namespaces have none.
const isRowOut = ([i, , inside], r) => i >= 0 ? isOut(whole, i) : isTitleOut(r);
// A title without any rows below it is hidden, too.
function isTitleOut(r) {
	let k = r + 1;
	while (k < rows.length && rows[k][2] && isRowOut(rows[k], k)) k++;
	return k > r + 1 && !rows[k]?.[2];
}
let placeOf = [];

const bit = (x, y, w, h) => `M${x.toFixed(1)} ${y.toFixed(1)}h${w.toFixed(1)}v${h.toFixed(1)}h${(-w).toFixed(1)}z`;
// A mark with the log events that it represents.
function markOf([className, ids, d]) {
	const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
	path.setAttribute('class', className);
	path.setAttribute('d', d);
	path.setAttribute(String(ids).includes(' ') ? 'data-entries' : 'data-entry', ids);
	return path;
}
// Draws everything in the available pixels.
function drawTime() {
	const small = !isBoard && !beforePrint && ($.deck.classList.contains('small') || innerWidth <= 760), wide = $.axis.clientWidth, x = s => part(s) * wide;
	pitch = small ? Math.max(2, Math.min(5, 48 / rows.length)) : ROW;
	let count = 0;
	placeOf = rows.map((row, r) => isRowOut(row, r) ? -1 : count++);
	rowNames.forEach((name, r) => { name.hidden = placeOf[r] < 0; });
	const high = pitch * count, d = { life: '', guess: '', bar: '' }, signs = [];
	rows.forEach(([, , , lives, bars, events], r) => {
		if (placeOf[r] < 0) return;
		const y = (placeOf[r] + .5) * pitch, tall = pitch * .8;
		for (let k = 0; k < lives.length; k += 3) {
			const [from, to, guessed] = lives.slice(k, k + 3);
			d[guessed ? 'guess' : 'life'] += `M${x(from).toFixed(1)} ${y}H${x(to).toFixed(1)}`;
		}
		for (let k = 0; k < bars.length; k += 3) {
			const h = pitch * (.16 + .06 * bars[k + 2]);
			d.bar += bit(x(bars[k]), y - h / 2, Math.max(.6, x(bars[k + 1]) - x(bars[k])), h);
		}
		for (const [s, sign, id] of events) signs.push([['start', 'end', 'event'][sign], id, [
			`M${x(s).toFixed(1)} ${y - tall / 2}v${tall}`,
			`M${(x(s) - tall / 3).toFixed(1)} ${y - tall / 3}l${tall / 1.5} ${tall / 1.5}m0 ${-tall / 1.5}l${-tall / 1.5} ${tall / 1.5}`,
			`M${(x(s) - tall / 4).toFixed(1)} ${y}l${tall / 4} ${-tall / 4}l${tall / 4} ${tall / 4}l${-tall / 4} ${tall / 4}z`][sign]]);
	});
	for (const [s, a, b, id] of hands) {
		if (placeOf[a] < 0 || placeOf[b] < 0) continue;
		const [from, to] = [a, b].map(r => (placeOf[r] + .5) * pitch), tip = Math.sign(to - from) * 4;
		signs.push(['hand', id, `M${x(s)} ${from}V${to}m-3 ${-tip}l3 ${tip}l3 ${-tip}M${x(s) - 2} ${from}a2 2 0 1 0 4 0a2 2 0 1 0 -4 0`]);
	}
	$.plot.setAttribute('width', wide);
	$.plot.setAttribute('height', high);
	for (const key in d) $.plot.querySelector('.' + key).setAttribute('d', d[key]);
	$.plot.querySelector('.events').replaceChildren(...signs.map(markOf));
	if (!data.sides) drawMarks(x);
	drawTicks(x, wide);
	drawRow();
	drawHead();
}
// A plus above, a diamond in the middle, a minus below; overlapping marks are merged.
function drawMarks(x) {
	const all = [], last = [];
	for (const [, , , lines] of told) for (const [s, sign, , , id] of lines) {
		const at = x(s);
		if (last[sign] && at - last[sign].at < 6) last[sign].ids += ' ' + id;
		else all.push(last[sign] = { at, sign, ids: String(id) });
	}
	$.marks.replaceChildren(...all.map(({ at, sign, ids }) =>
		markOf([KINDS[sign], ids, [`M${at - 3} 5h6m-3 -3v6`, `M${at - 3} 21h6`, `M${at} 9.5l3.5 3.5l-3.5 3.5l-3.5 -3.5z`][sign]])));
}
const STEPS = [.001, .002, .005, .01, .02, .05, .1, .2, .5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 43200, 86400];
function drawTicks(x, wide) {
	const least = long * 70 / wide, step = STEPS.find(s => s >= least) ?? Math.ceil(least / 86400) * 86400, ticks = [];
	for (let k = 0; k * step <= long && k < 400; k++) ticks.push(k * step);
	const clock = s => iso(s, s < 3600 ? 14 : 11, s % 1 ? 23 : 19), end = clock(long), spans = ticks.filter(s => x(s) < wide - 7 * end.length - 30).map(s => {
		const tick = make('span', { textContent: clock(+s.toFixed(3)) });
		tick.style.left = percent(s);
		return tick;
	});
	$.ticks.replaceChildren(...spans, make('span', { className: 'last', textContent: end }));
}
function drawHead() {
	for (const [id, from, to] of [['head', ...range ?? [now, now]], ['base', base, base]]) {
		$[id].hidden = from < 0 || !!data.sides;
		if ($[id].hidden) continue;
		$[id].style.left = percent(starts[from]);
		$[id].style.width = `max(3px, ${percent(ends[to] - starts[from])})`;
	}
}
function drawRow() {
	const r = rows.findIndex(([i]) => i >= 0 && i == sel), rect = $.plot.firstElementChild;
	rowNames.forEach((name, k) => name.classList.toggle('picked', k == r));
	for (const [key, value] of Object.entries({ x: 0, y: placeOf[r] * pitch || 0, width: r < 0 ? 0 : $.axis.clientWidth, height: pitch })) rect.setAttribute(key, value);
}
onSeek.push(drawHead);

// A click seeks; near a mark it goes to exactly that change; on a row it selects the element. Dragging the
// frame moves it; dragging elsewhere selects a range of windows.
const timeAt = e => (e.clientX - $.axis.getBoundingClientRect().left) / $.axis.clientWidth * total;
function markAt(e) {
	const s = timeAt(e), near = 7 / $.axis.clientWidth * total;
	let best = -1, least = near;
	for (const [w, , , lines] of told) for (const [time] of lines) if (Math.abs(time - s) < least) { least = Math.abs(time - s); best = w; }
	return best;
}
const rowAt = e => pitch < ROW ? -1 : rows[placeOf.indexOf(Math.floor((e.clientY - $.plot.getBoundingClientRect().top) / pitch))]?.[0] ?? -1;
let moved = 0, grip = 0, first = -1;
$.axis.onpointerdown = e => {
	if (e.target.closest('#band button') || e.button) return;
	moved = 0;
	if (e.isTrusted) $.axis.setPointerCapture(e.pointerId);
	if (data.sides) return;
	const w = e.target.closest('#marks') ? markAt(e) : -1, s = timeAt(e);
	const [from, to] = range ?? [now, now], inside = !range && s >= starts[from] && s < ends[to];
	// The frame keeps its offset to the pointer.
	grip = s - starts[now];
	first = inside && e.pointerType != 'touch' ? -1 : windowAt(s);
	anchor = -1;
	if (!inside || range || w >= 0) go(w < 0 ? windowAt(s) : w);
};
$.axis.onpointermove = e => {
	if (e.buttons && $.axis.hasPointerCapture(e.pointerId)) {
		moved += Math.abs(e.movementX);
		if (moved < 6 || data.sides) return;
		const s = timeAt(e), w = windowAt(Math.max(0, first < 0 ? s - grip + 1e-3 : s));
		if (first < 0) return w == now || go(w);
		if (w == now && range) return;
		span([first, w]);
		seek(w, 1);
		return;
	}
	const i = e.target.closest('#lives') ? rowAt(e) : -1, w = e.target.closest('#marks') ? markAt(e) : -1;
	if (i >= 0) hover(e, explain(whole, i, [windowAt(timeAt(e)), windowAt(timeAt(e))]));
	else if (w >= 0) hover(e, [`${clock(starts[w])} – ${clock(ends[w])}`, ...news.get(w).lines.slice(0, 8).map(line => line[3])]);
	else $.tip.hidden = true;
};
$.axis.onpointerup = e => {
	const i = e.target.closest('#axis') && document.elementsFromPoint(e.clientX, e.clientY).includes($.lives) ? rowAt(e) : -1;
	if (i >= 0 && moved < 6) pick(i, 1);
	save();
};
$.axis.onpointerleave = () => { $.tip.hidden = true; };
$.lives.onscroll = () => { $.rownames.scrollTop = $.lives.scrollTop; };
$.rownames.onscroll = () => { $.lives.scrollTop = $.rownames.scrollTop; };
$.seek.oninput = () => go(+$.seek.value);
