// Keys, buttons and initialization.
const toggle = (id, name, on) => { $[id].ariaPressed = on; document.body.classList.toggle(name, !on); };
const sideIsOpen = () => !document.body.classList.contains('noside');
function side(on) {
	toggle('toside', 'noside', on);
	resized();
}
function showLifelines(on) {
	$.tolifelines.ariaPressed = on;
	$.controls.classList.toggle('small', !on);
	resized();
}
function escape() {
	if (!$.big.hidden) return enlarge(false);
	if (!$.sheet.hidden) return table(false);
	if ($.q.value) return clearSearch();
	if (sel >= 0 || !$.card.hidden) { restore(); return pick(-1); }
	if (range) { span(null); return seek(now); }
	if (base >= 0) return compare(-1);
	showTime(0, long);
}
// Panel and lifelines are shown if there is space, until the user chooses.
let isChosen = false;
function arrange() {
	if (isChosen || beforePrint) return;
	side(innerWidth >= 1200 || isPhone());
	showLifelines(isTopicTimeline || !isPhone() && innerHeight > 600);
}
const choose = (arranges, on) => { isChosen = true; arranges(on); };
const MOVES = { ArrowRight: 1, ArrowLeft: -1, '.': 1, ',': -1, PageDown: W / 10, PageUp: -W / 10, Home: -W, End: W };
const KEYS = {
	' ': () => play(!timer), '[': () => jump(-1), ']': () => jump(1), p: () => jump(-1), n: () => jump(1),
	'+': () => zoom(1.25), '=': () => zoom(1.25), '-': () => zoom(.8), f: () => fit(homeOf()), z: () => bring([...near]), c: () => bring(marked()),
	'/': () => { choose(side, true); $.q.focus(); $.q.select(); }, '?': () => $.help.showModal(), Escape: escape,
	g: () => enlarge($.big.hidden), r: () => { if (data.sides) return; if (range) { span(null); seek(now); } else { anchor = now; go(now); } },
	b: () => compare(base < 0 ? now : -1), t: () => table($.sheet.hidden), l: () => choose(showLifelines, $.controls.classList.contains('small')), i: () => choose(side, !sideIsOpen()), w: () => zoomTime(.7), s: () => zoomTime(1.4),
	o: () => { if (group >= 0) unfold(); else if (folded) { show(shown == folded ? whole : folded); search(); firstView(); } },
};
const press = (key, far) => KEYS[key] ? KEYS[key]() : go(MOVES[key] ? now + Math.sign(MOVES[key]) * Math.ceil(Math.abs(MOVES[key] * far)) : Math.round(last * key / 10));
onkeydown = e => {
	const { key, target, shiftKey } = e;
	if (e.ctrlKey || e.altKey || e.metaKey || $.help.open) return;
	if (target.matches?.('input[type=search]')) {
		if (key == 'Enter' && target == $.q && hitList.length) pick(hitList.at((hitList.indexOf(sel) + (shiftKey ? -1 : 1)) % hitList.length), 1);
		if (key == 'Escape') { target == $.q ? clearSearch() : escape(); target.blur(); }
		return;
	}
	const known = KEYS[key] || MOVES[key] || /^\d$/.test(key);
	if (!known || target.matches?.('select') && key != 'Escape' || / |Enter/.test(key) && target.matches?.('button,summary,a,input,select,label')) return;
	if (target.closest?.('#scroll') && MOVES[key] && !/^[.,]$/.test(key)) return;
	e.preventDefault();
	press(key, shiftKey ? 10 : 1);
};
document.addEventListener('click', e => {
	const key = e.target.closest?.('button[data-key]')?.dataset.key, a = e.target.closest?.('a[href^="#"]');
	if (key) press(key, 1);
	// In a frame without its own address, a link would load the surrounding page.
	if (a) {
		e.preventDefault();
		visit(windowAt(parseFloat(a.hash.slice(3))));
		if (isPhone()) stage.scrollIntoView({ block: 'start' });
	}
});
// Until the user changes the view, it is adapted to every new size of the stage.
let fresh = false;
for (const event of ['pointerdown', 'wheel', 'keydown']) addEventListener(event, () => { fresh = false; }, { capture: true, passive: true });
// Keys continue to work after a choice.
$.speed.onchange = () => $.play.focus();
const resized = () => { if (beforePrint) return; wide = stage.clientWidth; high = stage.clientHeight; drawTime(); fresh ? firstView() : fit(view); if (!$.big.hidden) enlarge(true); };
new ResizeObserver(resized).observe(stage);
// The requested address, even if ours has replaced it since.
onhashchange = e => load(e.newURL.split('#')[1]);
if ($.open) $.open.hidden = !folded;
$.notes.hidden = !$.notes.querySelector('li');
addEventListener('resize', arrange);
arrange();
// Printed pages show the whole graph, with names and lifelines, regardless of the screen.
onbeforeprint = () => {
	beforePrint = [view, $.notes.open];
	$.notes.open = true;
	if (!isTopicTimeline) fit(homeOf());
	svg().classList.remove('norates', 'notopics', 'nonodes');
	document.body.classList.add('paper');
	showTime(0, long);
	[rowHeight, isFolded] = [14, false];
	// One table row each, so that no page break separates a name from its lifeline.
	const w = $.axis.clientWidth, line = (name, className, ...inside) => make('tr', { className }, make('td', { textContent: name }), make('td', {}, ...inside));
	$.printed.replaceChildren(make('thead', {}, line('', '', $.ticks.cloneNode(true))), make('tbody', {}, ...rows.map((row, r) => {
		if (isRowOut(row, r)) return '';
		const [d, marks] = pathsOf(row, 7, s => part(s) * w), own = set(drawn('svg', {}), { class: 'plot', width: w, height: 14 });
		own.append(...Object.entries(d).map(([key, d]) => drawn('path', { class: key, d })), ...marks);
		return line(row[1], row[0] < 0 && !row[2] ? 'space' : '', own);
	})));
};
onafterprint = () => {
	const [box, isOpen] = beforePrint;
	$.notes.open = isOpen;
	beforePrint = null;
	$.printed.replaceChildren();
	document.body.classList.remove('paper');
	resized();
	fit(box);
};
load(location.hash.slice(1));
