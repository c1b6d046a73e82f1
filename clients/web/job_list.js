// The server's jobs, newest first, each a link to its address.
import {forget, readPatiently, urlOf} from './calls.js';
import {asksForKey} from './access.js';
import {isFinal} from './follow.js';
import {by, element} from './page.js';

const pageSize = 12, busyMs = 3000, quietMs = 30000;
const items = new Map();  // id → its <li>, so that the focus stays where it is
let count = pageSize, timer = 0, isLoading = false, isAskedAgain = false;

export const addressOfJob = id => `#/jobs/${id}`;

/// Asks for the list now, and from now on again and again while the page is looked at.
export async function refreshJobs() {
  if (isLoading) {
    isAskedAgain = true;
    return;
  }
  clearTimeout(timer);
  isLoading = true;
  let jobs = [];
  try {
    const list = await (await readPatiently(`/v1/jobs?limit=${count}`)).json();
    jobs = list.jobs;
    show(jobs);
    by('more').hidden = !list.next_page_token;
  } catch (error) {
    if (!asksForKey(error, refreshJobs, false)) by('no-jobs').textContent = error.message;
  }
  isLoading = false;
  const isBusy = jobs.some(({state}) => !isFinal(state));
  if (isAskedAgain) refreshJobs();
  else if (!document.hidden) timer = setTimeout(refreshJobs, isBusy ? busyMs : quietMs);
  isAskedAgain = false;
}

document.addEventListener('visibilitychange', () => document.hidden ? clearTimeout(timer) : refreshJobs());
addEventListener('hashchange', markShown);
by('more').addEventListener('click', () => {
  count = Math.min(count + pageSize, 1000);
  refreshJobs();
});

function show(jobs) {
  by('no-jobs').textContent = 'What you render is listed here.';
  by('no-jobs').hidden = jobs.length > 0;
  const ids = new Set(jobs.map(({id}) => id));
  for (const [id, item] of items) {
    if (ids.has(id)) continue;
    forget(item.querySelector('img').src);
    item.remove();
    items.delete(id);
  }
  jobs.forEach((job, place) => {
    const item = items.get(job.id) ?? newItem(job.id);
    fill(item, job);
    const list = by('job-list');
    if (list.children[place] !== item) list.insertBefore(item, list.children[place] ?? null);
  });
  markShown();
}

function newItem(id) {
  const item = element('li', {}, element('a', {href: addressOfJob(id)},
    element('span', {className: 'thumbnail'}, element('img', {alt: '', hidden: true})),
    element('b', {className: 'name'}), element('span', {className: 'size'}), element('span', {className: 'job-state'}), element('time')));
  items.set(id, item);
  return item;
}

function fill(item, job) {
  const part = selector => item.querySelector(selector);
  part('.name').textContent = part('.name').title = job.name || 'unnamed';
  part('.size').textContent = job.width ? `${job.width} × ${job.height}` : '';
  part('.job-state').textContent = job.state === 'running' ? `running, ${Math.floor(job.progress.percent)} %` : job.state;
  part('.job-state').dataset.state = job.state;
  const time = part('time'), at = new Date(job.created_at);
  time.dateTime = job.created_at;
  time.title = at.toLocaleString();
  time.textContent = ago(at);
  const hasPicture = job.state === 'succeeded' && job.size_bytes !== null;
  if (hasPicture && part('img').hidden) showThumbnail(part('img'), job);
  else if (!hasPicture) part('img').hidden = true;
}

async function showThumbnail(image, job) {
  image.hidden = false;
  image.src = await urlOf(job.links.thumbnail).catch(() => '');
}

function ago(time) {
  const words = new Intl.RelativeTimeFormat('en', {numeric: 'auto'});
  const seconds = Math.min(0, Math.round((time - Date.now()) / 1000));
  for (const [unit, length] of [['day', 86400], ['hour', 3600], ['minute', 60]]) {
    if (-seconds >= length) return words.format(Math.ceil(seconds / length), unit);
  }
  return 'just now';
}

function markShown() {
  for (const [id, item] of items) {
    const link = item.querySelector('a');
    if (location.hash === addressOfJob(id)) link.setAttribute('aria-current', 'true');
    else link.removeAttribute('aria-current');
  }
}
