// What a window looks like: classes, rates, header. `shown` is the graph on the stage, `base` the window to compare with.
let now = 0, base = -1, shown = folded ?? whole, sel = -1, timer = 0, hits = null;
let near = new Set(), only = false;
const onSeek = [], stage = $.stage;
const calm = matchMedia('(prefers-reduced-motion)');

function classOf(g, i, w) {
	const k = g.class(i, w);
	if (base < 0) return g.classes[k];
	const [difference] = g.difference(i, base, w);
	if (difference == 'removed') return g.plain[g.class(i, base)] + ' removed';
	return (g.there[k] ? g.plain[k] : 'off') + (difference ? ' ' + difference : '');
}
function labelOf(g, i, w) {
	if (base >= 0) return g.difference(i, base, w)[1] ?? g.rate(i, w);
	const lifecycle = g.lives[i][2].length && g.lifecycle(i, w);
	const topic = i >= g.N && g.arrows[i - g.N][2], turn = g.turn(i, w);
	return lifecycle || (turn && topic ? topic + ' ' : '') + turn || g.labels[at(g.lives[i][1], w)];
}
// Brings the elements of the stage to the present window; answers which of them look different.
function dress() {
	const g = shown, moved = [];
	g.els.forEach((e, i) => {
		const look = classOf(g, i, now), cls = near.has(i) ? look + ' near' : look, all = hits?.has(i) ? cls + ' hit' : cls;
		if (all != g.cur[i]) {
			if (look != g.cur[i].replace(/ (near|hit)\b/g, '')) moved.push(i);
			e.setAttribute('class', g.base[i] + (g.cur[i] = all));
		}
		const text = g.live[i];
		if (look == 'off' || !text) return;
		const says = labelOf(g, i, now);
		if (text.says != says) text.textContent = text.says = says;
	});
	g.svg?.classList.toggle('filtered', only && !!hits);
	g.svg?.classList.toggle('pinned', near.size > 0);
	return moved;
}
// What is marked in the present window, or differs from the base.
function marked(g = shown) {
	const all = [];
	for (let i = 0; i < g.count; i++) if (base < 0 ? g.marks[g.class(i, now)] >= 0 : g.difference(i, base, now).length) all.push(i);
	return all;
}
function chipsOf() {
	if (base < 0) return news.get(now)?.chips ?? [];
	const sum = { added: [0, 0, 0], removed: [0, 0, 0], changed: [0, 0, 0] };
	marked(whole).forEach(i => sum[whole.difference(i, base, now)[0].split(' ')[0]][i < whole.N ? +(whole.kinds[i] % 3 > 0) : 2]++);
	const spell = (sign, counts) => counts.map((n, k) => n && `${sign}${n} ${['node', 'topic', 'edge'][k]}${n > 1 ? 's' : ''}`).filter(Boolean).join(' ');
	return [spell('+', sum.added), spell('−', sum.removed), spell('', sum.changed) && spell('', sum.changed) + ' changed'];
}
function seek(w, quiet) {
	w = Math.max(0, Math.min(last, w));
	const step = (w - now) ** 2;
	now = w;
	const moved = dress();
	if (step == 1 && moved.length < 41 && !calm.matches) moved.forEach(i => shown.els[i].animate({ opacity: [.2, 1] }, 250));
	header();
	onSeek.forEach(tell => tell());
	if (quiet) return;
	const lines = news.get(now)?.lines ?? [];
	say('live', [clock(starts[now]), `window ${now + 1} of ${W}`, ...lines.slice(0, 5).map(line => line[3])].join(', '));
	save();
}
function header() {
	const place = `window ${now + 1} of ${W}`, chips = chipsOf();
	say('where', data.sides?.[now] ?? `${place} · ${clock(starts[now])} – ${clock(ends[now])} of ${clock(total)}${base < 0 ? '' : ` · against window ${base + 1}, ${clock(starts[base])} – ${clock(ends[base])}`}`);
	$.clock.firstChild.textContent = iso(data.epoch / 1e3 + starts[now], 11, 19) + ' ';
	$.clock.lastChild.textContent = data.date;
	const p = phases.findLastIndex(([from]) => from < ends[now]);
	say('phase', p < 0 ? '' : `${p + 1} · ${phases[p][2]}`);
	$.phase.title = p < 0 ? '' : `phase ${p + 1} of ${phases.length}: ${phases[p][2]}`;
	// The events of the log that the chips count; what differs between any two windows need not be one.
	if (base < 0) $.chips.dataset.entries = (news.get(now)?.lines ?? []).map(line => line[4]).join(' ');
	else delete $.chips.dataset.entries;
	$.chips.replaceChildren(...chips.flatMap((text, m) => text ? [make('span', { className: KINDS[m], textContent: text })] : []));
	$.seek.value = now;
	$.seek.ariaValueText = [clock(starts[now]), place, ...chips.filter(Boolean)].join(', ');
}
function play(on) {
	if (!on && !timer) return;
	clearTimeout(timer);
	timer = on && setTimeout(() => { seek(now + 1, 1); play(now < last); }, 1e3 / $.speed.value);
	say('play', on ? 'Pause' : 'Play');
	if (on && now == last) seek(0, 1);
	if (!on) save();
}
const go = w => { play(0); seek(w); };
// To the next window with a headline; of the followed element only, if one is.
function jump(by) {
	const turns = $.follow.ariaPressed == 'true' && sel >= 0 ? whole.turns(sel) : news;
	let w = now;
	do w += by; while (w >= 0 && w < W && !turns.has(w));
	if (w >= 0 && w < W) go(w);
	else { play(0); say('live', by > 0 ? 'No change after this one' : 'No change before this one'); }
}
function compare(w) {
	base = w;
	$.compare.ariaPressed = base >= 0;
	say('compare', base < 0 ? 'Compare' : 'Stop comparing');
	seek(now);
}
// Shows another graph on the stage.
function show(g) {
	if (g == shown || !g) return;
	shown.svg.setAttribute('hidden', '');
	shown = g;
	shown.svg.removeAttribute('hidden');
	say('open', shown == folded ? 'Open all' : 'Fold');
	near = near_of(sel);
	dress();
	fit(shown.home);
}
