// The view of the stage: a gesture moves the picture by X, Y, S; at its end it is redrawn. Text that is too
// small to read is hidden.
const isTopicTimeline = document.body.classList.contains('topic-timeline');
let X = 0, Y = 0, S = 1, idle;
// A little more than 9 pixels, since the size of the stage is rounded.
const READABLE = 9.05, MOST = 6, pointers = new Map();
for (const g of [whole, folded]) if (g?.svg) g.home = g.svg.getAttribute('viewBox').split(' ').map(Number);
const svg = () => shown.svg ?? $.graph;
const homeOf = () => shown.home ?? (shown.home = $.graph.getAttribute('viewBox').split(' ').map(Number));
// The size of the stage. Querying it forces a layout of the page, so it is only queried if it may have
// changed.
let wide = stage.clientWidth, high = stage.clientHeight;
const scaleOf = ([, , w, h]) => Math.min(wide / w, high / h);
let view = homeOf();
// The visible part of the graph.
function visible() {
	const k = scaleOf(view), w = wide / k, h = high / k;
	return [view[0] + (view[2] - w) / 2, view[1] + (view[3] - h) / 2, w, h];
}
const [RATE, TOPIC, NODE] = sizes.map(size => READABLE / size);

function fit(box) {
	if (isTopicTimeline) return;
	view = [...box];
	svg().setAttribute('viewBox', view.join(' '));
	const k = scaleOf(view), list = svg().classList;
	list.toggle('norates', k < RATE * .999);
	list.toggle('notopics', k < TOPIC * .999);
	list.toggle('nonodes', k < NODE * .5);
	svg().style.setProperty('--name', Math.max(sizes[2], READABLE / k) + 'px');
	svg().style.setProperty('--drop', Math.max(0, READABLE / k - sizes[2]) * .35 + 'px');
	svg().style.setProperty('--space', Math.min(Math.max(sizes[3], 10 / k), 60) + 'px');
	minimap();
}
function zoom(by, dx = 0, dy = 0, x = wide / 2, y = high / 2) {
	const k = scaleOf(view) * S, fits = scaleOf(homeOf());
	by = Math.max(Math.min(fits, k) * .7, Math.min(MOST, k * by)) / k;
	X = x + (X - x) * by + dx;
	Y = y + (Y - y) * by + dy;
	S *= by;
	svg().style.willChange = 'transform';
	svg().style.transform = `translate(${X}px,${Y}px) scale(${S})`;
	clearTimeout(idle);
	idle = setTimeout(settle, 160);
}
// Redraws after a gesture, which only moves the picture.
function settle() {
	const k = scaleOf(view), [left, top, w, h] = visible();
	svg().style.willChange = svg().style.transform = '';
	viewBefore = null;
	fit([left - X / S / k, top - Y / S / k, w / S, h / S]);
	X = Y = 0;
	S = 1;
}
const boxesOf = all => all.flatMap(i => i < shown.N ? [shown.boxes[i]] : shown.ends(i).map(k => shown.boxes[k])).filter(Boolean);
function around(boxes) {
	const low = k => Math.min(...boxes.map(b => b[k])), high = k => Math.max(...boxes.map(b => b[k] + b[k + 2]));
	return [low(0) - 30, low(1) - 30, high(0) - low(0) + 60, high(1) - low(1) + 60];
}
// Zooms to some elements, so that their text is legible; `most` limits the scale.
function bring(all, least = RATE, most = 1.5) {
	const boxes = boxesOf(all);
	if (!boxes.length) return;
	const box = around(boxes), k = Math.min(most, Math.max(scaleOf(box), least)), w = wide / k, h = high / k;
	let [x, y] = [box[0] + box[2] / 2, box[1] + box[3] / 2];
	if (box[2] > w * 1.01 || box[3] > h * 1.01) [x, y] = densest(boxes, w, h);
	fit([x - w / 2, y - h / 2, w, h]);
}
// The middle of the boxes around one of them, which has most others in a window of this size.
function densest(boxes, w, h) {
	const near = ([x, y]) => boxes.filter(b => Math.abs(b[0] - x) < w / 2 - 40 && Math.abs(b[1] - y) < h / 2 - 20);
	const [x, y, bw, bh] = around(boxes.slice(0, 300).map(near).reduce((best, next) => next.length > best.length ? next : best));
	return [x + bw / 2, y + bh / 2];
}
// The whole graph if its names are legible or nobody can zoom out, else the changes of this window.
function firstView() {
	if (isTopicTimeline) return;
	if (scaleOf(homeOf()) >= TOPIC || document.body.classList.contains('bare')) return fit(homeOf());
	const all = marked();
	const some = all.length ? all : [...shown.names.keys()].filter(i => shown.isThere(i, now));
	bring(some, TOPIC, TOPIC);
}
// Brings the changes into view if less than half of them is visible: at the present scale if they fit, else at the
// smallest one at which they are legible.
function look() {
	const all = marked(), items = all.filter(i => i < shown.N), [x, y, w, h] = visible();
	const boxes = boxesOf(items.length ? items : all), seen = boxes.filter(([a, b, c, d]) => a + c / 2 > x && a + c / 2 < x + w && b + d / 2 > y && b + d / 2 < y + h);
	// Of a connection both ends.
	if (seen.length < boxes.length / (items.length ? 2 : 1)) bring(all, TOPIC, Math.max(TOPIC, scaleOf(view)));
	else if (!$.mini.hasAttribute('hidden')) outOfTheWay();
}

// The minimap: the whole graph, with a frame around the visible part.
const itemBoxes = all => [...all].filter(i => i < shown.N).map(i => shown.boxes[i]);
const outline = boxes => boxes.map(([x, y, w, h]) => `M${x} ${y}h${w}v${h}h-${w}z`).join('');
function minimap() {
	const [x, y, width, height] = visible(), hidden = !shown.svg || shown.boxes.every(b => b[0] >= x && b[1] >= y && b[0] + b[2] <= x + width && b[1] + b[3] <= y + height);
	$.mini.toggleAttribute('hidden', hidden);
	if (hidden) return;
	const [all, , picked, frame] = $.mini.children;
	if ($.mini.of != shown) {
		$.mini.of = shown;
		$.mini.setAttribute('viewBox', homeOf().join(' '));
		all.setAttribute('d', outline(shown.boxes));
	}
	markMini();
	picked.setAttribute('d', outline(itemBoxes(near)));
	set(frame, { x, y, width, height });
	outOfTheWay();
}
// The minimap is in the corner in which it covers the fewest changed and selected elements; if it covers any, it fades.
function outOfTheWay() {
	const k = scaleOf(view), { width: w, height: h } = $.mini.getBoundingClientRect(), edge = 14, [left, top] = visible();
	const boxes = itemBoxes([...near, ...marked()]).map(b => [(b[0] - left) * k, (b[1] - top) * k, b[2] * k, b[3] * k]);
	const covered = (x, y) => boxes.filter(b => b[0] < x + w + edge && b[0] + b[2] > x - edge && b[1] < y + h + edge && b[1] + b[3] > y - edge).length;
	const corners = [['', wide - w, high - h], ['west', 0, high - h], ['north', wide - w, 0], ['north west', 0, 0]].map(([name, x, y]) => [name, covered(x, y)]);
	const [name, many] = corners.reduce((best, next) => next[1] < best[1] ? next : best);
	$.mini.setAttribute('class', name + (many ? ' faint' : ''));
}
const markMini = () => $.mini.children[1].setAttribute('d', outline(itemBoxes(marked())));
onSeek.push(() => $.mini.hasAttribute('hidden') || markMini());
function lookFromMini(e) {
	const { left, top, width, height } = $.mini.getBoundingClientRect(), [x, y, w, h] = homeOf(), k = Math.min(width / w, height / h);
	const cx = x + w / 2 + (e.clientX - left - width / 2) / k, cy = y + h / 2 + (e.clientY - top - height / 2) / k;
	fit([cx - view[2] / 2, cy - view[3] / 2, view[2], view[3]]);
}
$.mini.onpointerdown = e => { e.stopPropagation(); if (e.isTrusted) $.mini.setPointerCapture(e.pointerId); lookFromMini(e); };
$.mini.onpointermove = e => { if (e.buttons) { e.stopPropagation(); lookFromMini(e); } };
$.mini.onclick = e => e.stopPropagation();

// Wheel, drag and pinch. A gesture with movement is not a click.
let far = 0;
const inStage = e => { const { left, top } = stage.getBoundingClientRect(); return [e.clientX - left, e.clientY - top]; };
const isGraph = e => !e.target.closest?.('#sheet');
stage.addEventListener('wheel', e => {
	if (!isGraph(e)) return;
	e.preventDefault();
	zoom(Math.exp(Math.max(-240, Math.min(240, e.deltaY)) * -.002), 0, 0, ...inStage(e));
}, { passive: false });
stage.addEventListener('pointerdown', e => {
	if (!isGraph(e)) return;
	if (!pointers.size) far = 0;
	pointers.set(e.pointerId, e);
});
stage.addEventListener('pointermove', e => {
	const old = pointers.get(e.pointerId);
	if (!old || !e.buttons) return pointers.delete(e.pointerId);
	far += Math.hypot(e.clientX - old.clientX, e.clientY - old.clientY);
	const other = [...pointers.values()].find(p => p.pointerId != e.pointerId);
	pointers.set(e.pointerId, e);
	if (!other) return zoom(1, e.clientX - old.clientX, e.clientY - old.clientY);
	const apart = p => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
	const [x, y] = inStage(e), [u, v] = inStage(other);
	zoom(apart(e) / Math.max(1, apart(old)), (e.clientX - old.clientX) / 2, (e.clientY - old.clientY) / 2, (x + u) / 2, (y + v) / 2);
});
for (const end of ['pointerup', 'pointercancel', 'pointerleave']) stage.addEventListener(end, e => pointers.delete(e.pointerId));
