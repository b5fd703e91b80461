// What the pages of the site do (make doc): the list of pages on a phone, places of this page, copying of code, the search.
// The index of the search, search.js, is made by tools/site_finish.py and read when the search is used first.
'use strict';

const root = document.body.dataset.root || '';
const $ = (id) => document.getElementById(id);

// the list of pages
$('menu').onclick = () => $('menu').setAttribute('aria-expanded', document.body.classList.toggle('menu'));
const page = location.pathname.split('/').pop() || 'index.html';
const source = page.replace('_source.html', '.html');
for (const a of document.querySelectorAll('#side a'))
  if (a.getAttribute('href') === page || (a.getAttribute('href') === 'api.html' && /_8h\.html$|^struct|^annotated|^globals/.test(source))) {
    a.className = 'here';
    a.setAttribute('aria-current', 'page');
    for (let p = a.parentElement; p; p = p.parentElement) if (p.tagName === 'DETAILS') p.open = true;
    const side = $('side');
    side.scrollTop = Math.max(0, a.offsetTop - side.clientHeight / 2);
  }

// the sections of this page
const heads = [...document.querySelectorAll('.contents h1')].filter((h) => h.querySelector('a.anchor[id]'));
if (heads.length > 2) {
  const list = document.createElement('nav');
  list.id = 'here';
  list.setAttribute('aria-label', 'on this page');
  for (const h of heads) {
    const a = list.appendChild(document.createElement('a'));
    a.href = '#' + h.querySelector('a.anchor').id;
    a.textContent = h.textContent.trim();
  }
  document.body.append(list);
}

// wide tables scroll in a box of their own; code can be copied
for (const table of document.querySelectorAll('table.markdownTable, table.memberdecls, table.directory')) {
  const box = document.createElement('div');
  box.className = 'scroll';
  table.replaceWith(box);
  box.append(table);
}
for (const block of document.querySelectorAll('.fragment')) {
  const button = document.createElement('button');
  button.className = 'copy';
  button.textContent = 'copy';
  button.onclick = () => {
    const lines = [...block.querySelectorAll('.line')].map((l) => l.textContent.replace(/^\s*\d+ ?(?=\S|$)/, (n) => (l.querySelector('.lineno') ? '' : n)));
    navigator.clipboard.writeText(lines.length ? lines.join('\n') : block.textContent.replace(/copy$/, '')).then(() => { button.textContent = 'copied'; });
  };
  block.append(button);
}

// the search: every word must be in the entry; words of a heading or a name count most, pages for users before fields of structs
let wanted = null;
function load() {
  if (wanted) return;
  wanted = document.createElement('script');
  wanted.src = root + 'search.js';
  wanted.onload = find;
  document.head.append(wanted);
}

function score(entry, words) {
  const [, title, heading, text] = entry.low;
  let sum = 0;
  for (const w of words) {
    const here = (heading === w ? 60 : heading.startsWith(w) ? 25 : heading.includes(w) ? 15 : 0) * (0.5 + w.length / (heading.length + 1)) +
      (title === w ? 40 : title.includes(w) ? 8 : 0);
    const n = text.split(w).length - 1;
    if (!here && !n) return 0;
    sum += here + Math.min(n, 5);
  }
  return sum * entry.weight;
}

function snippet(text, word) {
  const at = Math.max(0, text.toLowerCase().indexOf(word) - 60);
  return (at ? '... ' : '') + text.slice(at, at + 170);
}

function find() {
  const words = $('find').value.toLowerCase().split(/\s+/).filter(Boolean), box = $('found');
  box.hidden = !words.length;
  if (!words.length || typeof siteIndex === 'undefined') return;
  for (const e of siteIndex)
    if (!e.low) {
      e.low = e.map((s) => s.toLowerCase().replace(/\(\)$/, ''));
      e.weight = /^(struct|union|changelog|check_times)/.test(e[0]) ? 0.3 : /^notes_/.test(e[0]) ? 0.6 : /_8h/.test(e[0]) ? 0.9 : 1;
    }
  const hits = siteIndex.map((e) => [score(e, words), e]).filter(([s]) => s).sort((a, b) => b[0] - a[0]);
  box.replaceChildren();
  for (const [, [to, title, heading, text]] of hits.slice(0, 25)) {
    const a = box.appendChild(document.createElement('a'));
    a.href = root + to;
    a.appendChild(document.createElement('b')).textContent = heading || title;
    if (heading) a.append(' \u00b7 ' + title);
    a.appendChild(document.createElement('small')).textContent = snippet(text, words[0]);
  }
  const line = box.appendChild(document.createElement('p'));
  line.textContent = hits.length > 25 ? `${hits.length} places; more words give fewer` : hits.length ? '' : 'nothing with all of these words';
}

$('find').onfocus = load;
$('find').oninput = () => { load(); find(); };
$('find').onkeydown = (e) => {
  const all = [...$('found').querySelectorAll('a')], at = all.findIndex((a) => a.className === 'at');
  if (e.key === 'Escape') { $('find').value = ''; find(); $('find').blur(); }
  if (e.key === 'Enter' && all.length) location.href = (all[at] || all[0]).href;
  if (e.key === 'ArrowDown' || e.key === 'ArrowUp') {
    e.preventDefault();
    const next = all[Math.max(0, Math.min(all.length - 1, at + (e.key === 'ArrowDown' ? 1 : -1)))];
    all.forEach((a) => { a.className = a === next ? 'at' : ''; });
    if (next) next.scrollIntoView({ block: 'nearest' });
  }
};
document.addEventListener('click', (e) => { if (!e.target.closest('.find')) $('found').hidden = true; });
document.addEventListener('keydown', (e) => {
  if (e.key === '/' && !/INPUT|TEXTAREA/.test(document.activeElement.tagName)) { e.preventDefault(); $('find').focus(); }
});
