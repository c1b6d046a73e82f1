// The job that is shown: followed to its end, with previews, its picture and what became of it.
import {bytesOf, callPatiently, forget, pause, readPatiently} from './calls.js';
import {asksForKey} from './access.js';
import {follow, isFinal} from './follow.js';
import {refreshJobs} from './job_list.js';
import {by} from './page.js';
import {hideResult, showPicture, showResult} from './picture.js';
import {showProblem} from './problems.js';
import {showStats} from './stats.js';
import {setName, showState} from './status.js';

const previewMs = 1000;
let shown = null;  // {job, aborter, percent, isCanceling}; the aborter ends everything that is under way for it

export const shownId = () => shown?.job.id;
export const isUnderWay = () => shown !== null && !shown.aborter.signal.aborted && !isFinal(shown.job.state);

/// Shows this job, and no other any more.
export function showJob(job) {
  leaveJob();
  shown = {job, aborter: new AbortController(), percent: job.progress.percent};
  setName(job.name);
  hideResult();
  by('picture').classList.toggle('last', !isFinal(job.state));
  if (isFinal(job.state)) return showEnd(shown);
  by('cancel').disabled = false;
  by('result').setAttribute('aria-busy', 'true');
  showProgress(shown, {...job.progress, state: job.state});
  takeUp(shown);
}

/// What it does on the server goes on.
export function leaveJob() {
  shown?.aborter.abort();
  shown = null;
  setName('');
  showIdle();
}

function showIdle() {
  by('cancel').disabled = true;
  by('result').removeAttribute('aria-busy');
}

async function takeUp(view) {
  const {signal} = view.aborter;
  const onWait = () => showAway(view);
  const onProgress = progress => showProgress(view, progress);
  showPreviews(view);
  try {
    await follow(view.job, {onProgress, onWait, signal});
    view.job = await (await readPatiently(view.job.links.self, {signal, onWait})).json();
  } catch (error) {
    if (!signal.aborted) giveUp(view, error);
    return;
  }
  if (shown === view) showEnd(view);
  refreshJobs();
}

function showAway(view) {
  const rest = view.isCanceling ? 'the job is canceled as soon as it does' : 'it is asked again until it does';
  showState(`The server does not answer; ${rest}`, view.percent);
}

function showProgress(view, {percent, state, eta_s: eta}) {
  view.percent = percent;
  view.job.state = state;
  const rest = eta == null || percent < 1 ? '' : `, about ${Math.max(1, Math.round(eta))} s left`;
  showState(state === 'queued' ? 'Queued' : `Rendering${rest}`, percent);
}

async function showPreviews(view) {
  const {signal} = view.aborter;
  while (!signal.aborted && !isFinal(view.job.state)) {
    await pause(previewMs, signal).catch(() => {});
    // The last picture is better than a black one.
    if (signal.aborted || view.job.state !== 'running' || view.percent === 0) continue;
    const url = await bytesOf(view.job.links.preview).catch(() => null);
    if (url && shown === view && !isFinal(view.job.state)) {
      by('picture').classList.remove('last');
      showPicture(url, 'The picture so far');
    } else {
      forget(url);
    }
  }
}

async function showEnd(view) {
  const {job} = view;
  showIdle();
  if (job.state === 'failed') {
    showState('Failed', job.progress.percent, 'Failed');
    showFailure();
  } else if (job.state === 'canceled') {
    showState('Canceled', job.progress.percent, 'Canceled');
  } else {
    showStats(job.stats);
    if (job.size_bytes === null) return showState('Done; the picture was kept for its time and is gone', 100, 'Done');
    showState('Done', 100, 'Done');
    by('picture').classList.remove('last');
    await showResult(job, () => shown === view).catch(error => {
      if (shown === view) showState(`Done, but the picture does not come: ${error.message}`, 100, 'Done');
    });
  }
}

/// Why the job that is shown has failed, if it has: once more when another text has been opened.
export function showFailure() {
  if (shown?.job.state === 'failed') showProblem(shown.job.error ?? {detail: 'The render failed'});
}

/// Whoever has no key, or the wrong one, may go on with another.
function giveUp(view, error) {
  view.aborter.abort();
  showIdle();
  const texts = {401: 'The server asks for a key', 403: 'The key does not allow this', 404: 'The server no longer knows this job'};
  showState(texts[error.status] ?? error.message);
  asksForKey(error, () => shown === view && showJob(view.job));
}

export async function cancelJob() {
  const view = shown;
  view.isCanceling = true;
  await callPatiently(view.job.links.cancel, {method: 'POST', onWait: () => shown === view && isUnderWay() && showAway(view)}).catch(error => {
    view.isCanceling = false;
    // One that has ended meanwhile says so in its events.
    if (error.status === 409 || asksForKey(error, cancelJob)) return;
    showState(`Not canceled: ${error.message}`, view.percent);
  });
}
