// Export: a link to exactly this view, and the view as a picture.
let later;
const esc = text => encodeURIComponent(text).replace(/%2F/g, '/').replace(/%3A/g, ':');
function link() {
	const parts = { t: starts[now], b: base < 0 ? '' : starts[base], sel: sel >= 0 ? whole.key(sel) : group >= 0 ? folded.key(group) : '', q: $.q.value, table: $.sheet.hidden ? '' : 1, e: range ? ends[range[1]] : '', out: [...without].join(',') };
	if (range) parts.t = starts[range[0]];
	const flags = ['bare', 'loop'].filter(flag => new URLSearchParams(location.hash.slice(1)).has(flag)).map(flag => flag + '&').join('');
	return '#' + flags + Object.entries(parts).filter(([, value]) => value !== '').map(([key, value]) => key + '=' + esc(value)).join('&');
}
// Writes the link and the view into the history; a jump to another place is a new entry, so that Back returns to the last one.
let isLoading = false, isAway = false;
const write = how => { if (!timer) try { history[how]([view, shown == folded], '', link()); } catch {} };
function leave() {
	if (isLoading || isAway) return;
	clearTimeout(later);
	write('replaceState');
	isAway = true;
}
function save() {
	clearTimeout(later);
	later = setTimeout(() => { write(isAway && link() != location.hash ? 'pushState' : 'replaceState'); isAway = false; }, 50);
}
// A window by its time; an element by its kind and name, or by its name alone, in which case nodes precede
// topics.
function load(hash = '') {
	const [box, isFolded] = history.state ?? NONE;
	isLoading = true;
	const to = new URLSearchParams(hash), time = parseFloat(to.get('t')), against = parseFloat(to.get('b'));
	$.q.value = to.get('q') ?? '';
	base = against >= 0 ? windowAt(against) : -1;
	now = time >= 0 ? windowAt(time) : to.has('bare') ? 0 : data.still;
	const end = parseFloat(to.get('e'));
	span(end > time ? [now, windowAt(end - 1e-3)] : null);
	for (const space of to.get('out')?.split(',') ?? []) without.add(space);
	listSpaces();
	for (const flag of ['bare', 'loop']) document.body.classList.toggle(flag, to.has(flag));
	resized();
	looping = to.has('loop');
	if (range) seek(now);
	else compare(base);
	const name = to.get('sel'), i = ['', 'node:', 'topic:', 'topics:', 'edge:'].map(kind => whole.keys.get(kind + name)).find(i => i >= 0);
	firstView();
	pick(name === null ? -1 : i ?? -1, 1, time >= 0);
	fresh = name === null && !box;
	if (!(i >= 0) && folded?.keys.has(name)) pickGroup(folded.keys.get(name));
	search();
	if (to.get('table')) table(true);
	if (box) {
		show(isFolded ? folded : whole);
		fit(box);
	}
	isLoading = false;
	if (looping && !calm.matches) play(1);
}
// The stage as it is, below the name, the time and the sentence, with its style rules and its font.
const HEAD = 44;
function picture() {
	const copy = svg().cloneNode(true), [x, top, width, part] = visible(), unit = width / wide, y = top - HEAD * unit, height = part + HEAD * unit;
	set(copy, { xmlns: 'http://www.w3.org/2000/svg', width: wide, height: high + HEAD, viewBox: [x, y, width, height].join(' ') });
	const { color, backgroundColor: fill } = getComputedStyle(document.body), most = wide / 6.5;
	copy.prepend(drawn('style', {}, [...document.querySelectorAll('style')].map(sheet => sheet.textContent).join('')), $.signs.querySelector('defs').cloneNode(true), drawn('rect', { x, y, width, height, fill }));
	copy.append(drawn('rect', { x, y, width, height: HEAD * unit, fill }), ...[`${mission} · ${$.where.textContent}`, $.sentence.textContent].map((text, k) =>
		drawn('text', { x: x + 8 * unit, y: y + (18 + 18 * k) * unit, fill: color, 'font-family': 'Inter', 'font-size': 12 * unit }, text.length > most ? text.slice(0, most) + '…' : text)));
	copy.querySelectorAll('.off').forEach(e => e.remove());
	return new XMLSerializer().serializeToString(copy);
}
const mission = document.querySelector('h1').textContent;
const fileOf = kind => `${mission.replace(/\.\w+$/, '').replace(/[^\w.-]+/g, '_')}_${clock(starts[now]).replace(/:/g, '-')}.${kind}`;
// An answer beside the list of things to save, for two seconds.
function tell(text) {
	const { left, top } = $.save.getBoundingClientRect();
	setText('live', text);
	hover({ clientX: left, clientY: top }, [text]);
	setTimeout(() => { $.tip.hidden = true; }, 2000);
}
function download(href, kind) {
	const a = make('a', { href, download: fileOf(kind) });
	a.click();
	tell(`Saved ${a.download}`);
}
async function savePicture(kind) {
	const url = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(picture());
	if (kind == 'svg') return download(url, kind);
	const image = new Image(), canvas = make('canvas', { width: wide * 2, height: (high + HEAD) * 2 });
	image.src = url;
	await image.decode();
	canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
	download(canvas.toDataURL('image/png'), kind);
}
$.save.onchange = async () => {
	const what = $.save.value;
	$.save.value = '';
	$.save.blur();
	if (what != 'link') return savePicture(what);
	const url = location.href.split('#')[0] + link();
	try { await navigator.clipboard.writeText(url); tell('Link copied'); } catch { tell(url); prompt?.('The link', url); }
};
