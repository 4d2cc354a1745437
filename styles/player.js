// Plays #data. Elements are numbered: items, then arrows.
const $ = new Proxy({}, { get: (_, id) => document.getElementById(id) }), say = (id, text) => $[id].textContent = text;
let raw = $.data.textContent;
if ($.data.type == 'deflated') raw = await new Response(new Blob([Uint8Array.from(atob(raw), c => c.charCodeAt())]).stream().pipeThrough(new DecompressionStream('deflate-raw'))).text();
const { names, arrows, facts, words, classes, labels, lives, starts, end, epoch, boxes, told } = JSON.parse(raw);
say('data', raw = '');
const N = names.length, W = starts.length, last = W - 1, svg = $.graph, stage = $.stage, els = [...$.items.children, ...$.arrows.children];
const name = names.concat(arrows.map(ends => ends.map(i => names[i]).join(' → '))), about = facts.map(list => list.map(f => words[f]).join('\n'));
const ends = i => i < N ? arrows.flatMap((a, k) => a.includes(i) ? N + k : []) : arrows[i - N];

// Spells: windows since the last, value, …
for (const list of lives.flat()) for (let i = 2; i < list.length; i += 2) list[i] += list[i - 2];
const at = (list, w, lo = 0, hi = list.length) => {
	while (lo < hi) { const mid = (lo + hi >> 2) * 2; list[mid] <= w ? lo = mid + 2 : hi = mid; }
	return lo && list[lo - 1];
};
const KINDS = ['added', 'removed', 'changed'], mark = classes.map(c => KINDS.findIndex(k => c.includes(k))), turns = classes.map(c => /ster|wer/.test(c));
// Headlines by window: how many, and the words of three chips.
const chips = new Map(told.map(([w, n, ...texts]) => [w, { n, texts }]));
const iso = (s, from, to) => new Date(s * 1e3).toISOString().slice(from, to), clock = s => iso(s, s < 3600 ? 14 : 11, s % 1 ? 23 : 19);
const list = (id, all) => $[id].replaceChildren(...all.slice(0, 50).map(i => Object.assign(document.createElement('button'), { textContent: name[i], className: classes[cur[i]], onclick: () => pick(i, 1) })));

let now = 0, sel = -1, near = new Set(), timer = 0, later, hits = [], news = [];
const cur = els.map(() => -1), base = els.map(e => e.classList[0] + ' '), live = els.map(e => e.querySelector('.r'));
const dress = i => els[i]?.setAttribute('class', base[i] + classes[cur[i]] + (near.has(i) ? ' near' : ''));
function seek(w, quiet) {
	w = Math.max(0, Math.min(last, w));
	const moved = [], time = clock(starts[w]), place = `window ${w + 1} of ${W}`;
	news = [];
	els.forEach((_, i) => {
		const [life, rates, cycle] = lives[i], k = at(life, w), text = live[i];
		if (k != cur[i]) { cur[i] = k; dress(i); moved.push(i); }
		if (mark[k] >= 0) news.push(i);
		if (!k || !text) return;
		const told = cycle[0] + 1 ? labels[at(cycle, w)] : (turns[k] ? labels[at(rates, w - 1)].replace('Hz', '→ ') : '') + labels[at(rates, w)];
		if (text.told != told) text.textContent = text.told = told;
	});
	if ((w - now) ** 2 == 1 && moved.length < 41 && !matchMedia('(prefers-reduced-motion)').matches) moved.forEach(i => els[i].animate({ opacity: [.2, 1] }, 250));
	now = w;
	say('where', `${place} · ${time} – ${clock(starts[w + 1] ?? end)} of ${clock(end)}`);
	say('clock', iso(epoch / 1e3 + starts[w], 11, 19));
	const { n = 0, texts = [] } = chips.get(w) ?? {};
	$.chips.dataset.entries = n;
	$.chips.innerHTML = texts.map((t, m) => t && `<span class=${KINDS[m]}>${t}</span> `).join('');
	if ($.head) for (const k of ['x', 'width']) $.head.setAttribute(k, $.head.dataset[k].split(' ')[w]);
	$.seek.value = w;
	$.seek.ariaValueText = [time, place, $.chips.textContent].join(', ');
	list('news', news);
	card();
	if (quiet) return;
	say('live', [time, place, ...news.slice(0, 5).map(i => name[i] + ' ' + KINDS[mark[cur[i]]])].join(', '));
	save();
}
function play(on) {
	clearTimeout(timer);
	timer = on && setTimeout(() => { seek(now + 1, 1); play(now < last); }, 1e3 / $.speed.value);
	say('play', on ? 'Pause' : 'Play');
	if (on && now == last) seek(0, 1);
	save();
}
const go = w => { play(0); seek(w); };
const jump = by => { let w = now; do w += by; while (w >= 0 && w < W && !chips.has(w)); go(w); };

// The selection.
function pick(i, look) {
	const old = near;
	sel = i;
	near = new Set([i, ...ends(i).flatMap(k => k < N ? k : [k, ...ends(k)])]);
	[...old, ...near].forEach(dress);
	svg.classList.toggle('pinned', i >= 0);
	card();
	if (look) bring([i], Math.max(svg.getCTM().a, .8));
	save();
}
function card() {
	if ($.card.hidden = sel < 0) return;
	const [life, rates, cycle] = lives[sel], bit = (c, x, to = W) => `<rect class="${c}" x=${x} width=${to - x} height=9 />`;
	say('name', name[sel]);
	$.life.innerHTML = life.map((k, i) => i % 2 && k ? bit(classes[k], life[i - 1], life[i + 1]) : '').join('') + bit('head', now, now + 1 + W / 200);
	say('facts', `${classes[cur[sel]].replace(/ w\d/, '')} ${labels[at(rates, now)]} ${labels[at(cycle, now)]}\n` + about[sel]);
	list('ends', ends(sel));
}
function search() {
	const q = $.q.value.toLowerCase();
	hits = q ? els.flatMap((_, i) => (name[i] + about[i]).toLowerCase().includes(q) ? i : []) : [];
	say('count', q && hits.length + ' of ' + els.length);
	list('hits', hits);
	save();
}

// The link.
function save() {
	const add = (k, v = '') => v && `&${k}=` + encodeURIComponent(v).replace(/%2F/g, '/');
	clearTimeout(later);
	later = setTimeout(() => { if (!timer) try { history.replaceState(0, '', '#t=' + starts[now] + add('sel', name[sel]) + add('q', $.q.value)); } catch {} }, 50);
}
function load() {
	const link = new URLSearchParams(location.hash.slice(1));
	$.q.value = link.get('q');
	seek(starts.findLastIndex(s => s <= +link.get('t') + 1e-6));
	pick(name.indexOf(link.get('sel')), 1);
	search();
}

// A gesture moves the picture by X, Y, S; its end draws it anew.
let X = 0, Y = 0, S = 1, far = 0, idle, old;
const home = svg.attributes.viewBox.value, fit = box => svg.setAttribute('viewBox', box);
function zoom(by, dx = 0, dy = 0, x = stage.clientWidth / 2, y = stage.clientHeight / 2) {
	X = x + (X - x) * by + dx;
	Y = y + (Y - y) * by + dy;
	S *= by;
	svg.style.cssText = `will-change:transform;transform:translate(${X}px,${Y}px) scale(${S})`;
	clearTimeout(idle);
	idle = setTimeout(() => {
		svg.style.cssText = '';
		const { a, e, f } = svg.getCTM();
		fit([(-X / S - e) / a, (-Y / S - f) / a, stage.clientWidth / a / S, stage.clientHeight / a / S]);
		X = Y = 0;
		S = 1;
	}, 160);
}
function bring(all, k) {
	const b = all.flatMap(i => i < N ? [boxes[i]] : ends(i).map(k => boxes[k])), low = k => Math.min(...b.map(b => b[k])), size = k => Math.max(...b.map(b => b[k] + b[k + 2])) - low(k);
	if (!b[0]) return;
	const w = k ? stage.clientWidth / k : size(0) + 60, h = k ? stage.clientHeight / k : size(1) + 60;
	fit([low(0) + (size(0) - w) / 2, low(1) + (size(1) - h) / 2, w, h]);
}
stage.onwheel = e => { e.preventDefault(); zoom(Math.exp(e.deltaY * -.002), 0, 0, e.pageX - stage.offsetLeft, e.pageY - stage.offsetTop); };
stage.onpointerdown = e => { old = e; far = 0; };
stage.onpointermove = e => {
	if (!old || !e.buttons || !e.isPrimary) return;
	far++;
	zoom(1, e.x - old.x, e.y - old.y);
	old = e;
};
svg.onclick = e => far < 5 && pick(els.indexOf(e.target.closest('g g')));

const tenth = Math.ceil(W / 10), MOVES = { ',': -1, '.': 1, ArrowLeft: -1, ArrowRight: 1, PageUp: -tenth, PageDown: tenth, Home: -W, End: W };
const KEYS = {
	' ': () => play(!timer), '[': () => jump(-1), ']': () => jump(1), '+': () => zoom(1.25), '-': () => zoom(.8), f: () => fit(home),
	z: () => bring([...near]), c: () => bring(news), '/': () => $.q.focus(), '?': () => $.help.showModal(), Escape: () => pick(-1),
};
const press = (key, far) => KEYS[key] ? KEYS[key]() : go(MOVES[key] ? now + MOVES[key] * far : Math.round(last * key / 10));
onkeydown = e => {
	const { key, target, shiftKey } = e;
	if (e.ctrlKey || e.altKey || e.metaKey || $.help.open || target == $.speed) return;
	if (target == $.q) {
		if (key == 'Enter' && hits[0] >= 0) pick(hits.at((hits.indexOf(sel) + (shiftKey ? -1 : 1)) % hits.length), 1);
		if (key == 'Escape') target.blur();
	} else if (!(/ |Enter/.test(key) && target.matches('button,summary,a')) && (KEYS[key] || MOVES[key] || /^\d$/.test(key))) {
		e.preventDefault();
		press(key, shiftKey ? 10 : 1);
	}
};
onclick = ({ target: { dataset: { key } } }) => key && press(key, 1);
$.seek.oninput = () => go(+$.seek.value);
$.q.oninput = search;
onhashchange = load;
load();
