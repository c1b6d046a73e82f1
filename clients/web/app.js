// The page: a text, the job made of it, and what the browser keeps of both.
import {Refusal, callPatiently, readPatiently} from './calls.js';
import {asksForKey} from './access.js';
import * as editor from './editor.js';
import {firstExample, loadExamples, pictureOf, textOf} from './examples.js';
import {addressOfJob, refreshJobs} from './job_list.js';
import {cancelJob, isUnderWay, leaveJob, showFailure, showJob, shownId} from './job_view.js';
import {parsed, readable} from './json_text.js';
import {keep, kept} from './kept.js';
import {createOptions, forgetWaiting, readOptions, waitingOptions, writeOptions} from './options.js';
import {by} from './page.js';
import {clearPicture, showPicture} from './picture.js';
import {clearProblem, showProblem} from './problems.js';
import {showState} from './status.js';

let origin = {};     // where the text came from: {example} or {job}
let chosen = '';     // the last example that was asked for
let sending = null;  // the AbortController of what is being sent

// What is kept --------------------------------------------------------------------------------------------------------

const whenIdle = window.requestIdleCallback ?? setTimeout;
let readTimer = 0, keepTimer = 0, changedAt = 0;

function keepNow() {
  clearTimeout(keepTimer);
  keepTimer = changedAt = 0;
  const about = {origin, edited: editor.isEdited(), waiting: waitingOptions()};
  by('not-kept').hidden = keep(editor.text(), about);
}

/// A big text is neither read nor kept at every key, which would be slow: a page that is left keeps it in any case, and the
/// timer is for browsers that die.
function onChange() {
  clearTimeout(readTimer);
  readTimer = setTimeout(() => whenIdle(readOptions), 300);
  changedAt ||= Date.now();
  clearTimeout(keepTimer);
  keepTimer = setTimeout(() => whenIdle(keepNow), Math.max(0, Math.min(2000, changedAt + 15000 - Date.now())));
}

addEventListener('pagehide', () => keepTimer && keepNow());
document.addEventListener('visibilitychange', () => document.hidden && keepTimer && keepNow());
addEventListener('beforeunload', event => {
  if (keepTimer) keepNow();
  if (!by('not-kept').hidden && editor.isEdited()) event.preventDefault();
});

// Another text --------------------------------------------------------------------------------------------------------

/// Whether edits that nobody else has may be replaced: asked of who made them.
function mayReplace(byWhat) {
  if (!editor.isEdited()) return true;
  by('replace-what').textContent = byWhat;
  const dialog = by('replace');
  dialog.returnValue = '';
  dialog.showModal();
  return new Promise(resolve => dialog.addEventListener('close', () => resolve(dialog.returnValue === 'replace'), {once: true}));
}

function openText(text, from) {
  editor.open(text);
  origin = from;
  by('example').value = from.example ?? '';
  clearProblem();
  forgetWaiting();
  keepNow();
}

async function chooseExample() {
  const name = chosen = by('example').value;
  by('example').value = origin.example ?? '';
  if (!name) return;
  let hasWaited = false;
  const text = await textOf(name, () => {
    hasWaited = true;
    showState('The server does not answer; the example comes as soon as it does');
  });
  if (hasWaited && !isUnderWay()) showState('The server answers again');
  // Asked when it is there, for somebody may be typing until then.
  if (chosen !== name || !await mayReplace(`the example ${name}`)) return;
  openText(text, {example: name});
  if (isUnderWay()) return;
  leaveJob();
  history.pushState(null, '', location.pathname + location.search);
  dispatchEvent(new Event('hashchange'));
}

// Addresses -----------------------------------------------------------------------------------------------------------

async function goToAddress() {
  const id = location.hash.match(/^#\/jobs\/([\w-]{1,64})$/)?.[1];
  if (!id) return showStart();
  if (id !== shownId()) await openJob(id);
}

/// No job: the example's picture.
function showStart() {
  leaveJob();
  clearPicture();
  showState('Nothing rendered yet');
  const url = pictureOf(origin.example);
  if (url) showPicture(url, `What ${origin.example} looks like`);
}

/// What a program has written is in one line, or in very long ones.
const isForPeople = text => text.trim().includes('\n') && !/.{1000}/.test(text);

async function openJob(id) {
  const isWanted = () => location.hash === addressOfJob(id);
  const onWait = () => isWanted() && showState('The server does not answer; it is asked again until it does');
  leaveJob();
  clearPicture();
  clearProblem();
  showState('Looking for the job');
  by('status').scrollIntoView({block: 'nearest'});
  try {
    const job = await (await readPatiently(`/v1/jobs/${id}`, {onWait})).json();
    if (!isWanted()) return;
    showJob(job);
    // The text is that job's already, or edits of it.
    if (origin.job === id) return;
    const text = await (await readPatiently(job.links.scene)).text();
    const readableText = isForPeople(text) ? text : readable(parsed(text));
    if (isWanted() && (editor.text() === readableText || await mayReplace(`the scene of ${job.name || 'this job'}`))) openText(readableText, {job: id});
    showFailure();
  } catch (error) {
    if (!isWanted()) return;
    if (error.status === 410) return showProblem({title: 'The text is not this job’s', detail: 'its scene was kept for its time and is gone'});
    showState(error.status === 404 ? 'The server no longer knows this job' : asksForKey(error, () => isWanted() && openJob(id)) ? 'The server asks for a key' : error.message);
  }
}

// Sending -------------------------------------------------------------------------------------------------------------

/// Says to the server that a call made again is the same.
const newIdempotencyKey = () => Array.from(crypto.getRandomValues(new Uint8Array(16)), byte => byte.toString(16).padStart(2, '0')).join('');

async function submit() {
  if (sending) return;
  if (document.activeElement !== by('text')) writeOptions();
  clearProblem();
  setSending(new AbortController());
  const {text, sent} = editor.sending();
  showState('Sending');
  try {
    const answer = await callPatiently('/v1/jobs', {
      method: 'POST', body: text, signal: sending.signal,
      headers: {'Content-Type': 'application/json', 'Idempotency-Key': newIdempotencyKey()},
      onWait: () => showState('The server does not answer; the scene is sent as soon as it does'),
    });
    const job = await answer.json();
    setSending(null);
    sent();
    origin = {...origin, job: job.id};
    keepNow();
    showJob(job);
    location.hash = addressOfJob(job.id);
    refreshJobs();
  } catch (error) {
    const isStopped = sending?.signal.aborted;
    setSending(null);
    if (isStopped) return showState('Not sent');
    showState('Not accepted');
    if (!asksForKey(error, submit)) showProblem(error instanceof Refusal ? error.problem : {detail: error.message});
  }
}

function setSending(aborter) {
  sending = aborter;
  by('render').disabled = aborter !== null;
  by('cancel').disabled = aborter === null && !isUnderWay();
}

// The beginning -------------------------------------------------------------------------------------------------------

async function begin() {
  const last = kept();
  editor.createEditor(by('text'), {onChange, onSubmit: submit});
  if (last) {
    editor.open(last.text, last.about.edited);
    origin = last.about.origin ?? {};
  }
  createOptions(last?.about.waiting, onChange);
  readOptions();
  refreshJobs();
  const onWait = () => showState('The server does not answer; it is asked again until it does');
  await loadExamples(onWait);
  by('example').value = origin.example ?? '';
  const isJob = location.hash.startsWith('#/jobs/');
  if (!last && !isJob) openText(await textOf(firstExample(), onWait), {example: firstExample()});
  await goToAddress();
}

by('job').addEventListener('submit', event => { event.preventDefault(); submit(); });
by('cancel').addEventListener('click', () => sending ? sending.abort() : cancelJob());
by('example').addEventListener('change', chooseExample);
addEventListener('hashchange', goToAddress);
addEventListener('keydown', event => {
  if (event.key === 'Enter' && (event.ctrlKey || event.metaKey) && !event.defaultPrevented) submit();
});
begin().catch(error => showState(`The examples could not be loaded: ${error.message}`));
