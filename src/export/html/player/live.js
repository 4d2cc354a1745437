// Only in a page that is served while the recording grows: a newer page replaces this one if the newest
// window is shown; otherwise it waits.
let shownPage, newestPage;
const renew = () => {
	if (newestPage == shownPage || now < last || timer || $.help.open) return;
	history.replaceState(0, '', link().replace(/t=[^&]*/, 't=1e9'));
	location.reload();
};
new EventSource('events').onmessage = ({ data }) => {
	shownPage ??= data;
	newestPage = data;
	renew();
};
onSeek.push(renew);
if (!location.hash) go(last);
