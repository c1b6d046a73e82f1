// The page: edits a job's JSON, submits it, follows its events, shows previews, the picture and errors at their place.
import {call, follow as followEvents, key, setKey, urlOf} from './calls.js';
import {locate} from './locate.js';

const by = id => document.getElementById(id);
const body = by('body'), bar = by('bar'), picture = by('picture');
const optionFields = ['width', 'height', 'samples_per_pixel', 'shadow_samples', 'acceleration'];
let job = null;      // the job being followed: its resource
let events = null;   // its event stream
let previewTimer = 0;
let format = 'png';  // of the image that was asked for

// Examples ------------------------------------------------------------------------------------------------------------

async function loadExamples() {
  const scenes = await (await fetch('/scenes/index.json')).json();
  const select = by('example');
  select.replaceChildren(...scenes.map(({name, path}) => new Option(name, path)));
  const first = scenes.find(scene => scene.name === 'hard-and-soft') ?? scenes[0];
  if (!first) return;
  select.value = first.path;
  await openExample();
}

async function openExample() {
  const value = await (await fetch(by('example').value)).json();
  body.value = readable(value);
  showOptions();
  clearErrors();
}

// Indented, but with short arrays of numbers on one line; a mesh's long ones stay on one line too.
function readable(value, indent = '') {
  if (Array.isArray(value) && value.every(item => typeof item !== 'object')) return JSON.stringify(value);
  if (Array.isArray(value) && value.every(item => Array.isArray(item) && item.length <= 3)) return JSON.stringify(value);
  if (value === null || typeof value !== 'object') return JSON.stringify(value);
  const inner = indent + '  ';
  const lines = Array.isArray(value) ? value.map(item => inner + readable(item, inner))
    : Object.entries(value).map(([key, item]) => `${inner}${JSON.stringify(key)}: ${readable(item, inner)}`);
  const [open, close] = Array.isArray(value) ? '[]' : '{}';
  return lines.length ? `${open}\n${lines.join(',\n')}\n${indent}${close}` : open + close;
}

// The option fields and the JSON show the same values -----------------------------------------------------------------

function parsed() {
  try {
    const value = JSON.parse(body.value);
    return value && typeof value === 'object' && !Array.isArray(value) ? value : null;
  } catch {
    return null;
  }
}

function showOptions() {
  const options = parsed()?.options ?? {};
  for (const name of optionFields) by(name).value = options[name] ?? '';
}

function writeOption(event) {
  const value = parsed();
  if (!value) return;
  const {name, value: text, type} = event.target;
  value.options ??= {};
  if (text === '') delete value.options[name];
  else value.options[name] = type === 'number' ? Number(text) : text;
  body.value = readable(value);
  clearErrors();
}

// Errors --------------------------------------------------------------------------------------------------------------

function clearErrors() {
  by('errors').hidden = true;
  // Hidden text still describes the field.
  by('problem').textContent = '';
  by('error-list').replaceChildren();
  body.classList.remove('bad');
  for (const field of [body, ...optionFields.map(by)]) field.removeAttribute('aria-invalid');
}

function showProblem(problem) {
  const errors = problem.errors ?? [];
  // The detail of a problem with a list says what the list says.
  const shown = errors.length ? [problem.title] : [problem.title, problem.detail];
  by('problem').textContent = shown.filter(Boolean).join(': ') || 'The server refused the job';
  by('error-list').replaceChildren(...errors.map(({pointer, detail}) => {
    const place = document.createElement('button');
    place.type = 'button';
    place.textContent = `${pointer || '(the whole body)'}: ${detail}`;
    place.addEventListener('click', () => select(pointer));
    const item = document.createElement('li');
    item.append(place);
    return item;
  }));
  by('errors').hidden = false;
  const isOption = ({pointer}) => optionFields.some(name => pointer === `/options/${name}`);
  for (const {pointer} of errors.filter(isOption)) by(pointer.slice('/options/'.length)).setAttribute('aria-invalid', 'true');
  if (!errors.length && problem.status !== 400) return;  // not about the text
  body.classList.add('bad');
  body.setAttribute('aria-invalid', 'true');
  if (errors.length) select(errors[0].pointer, false);
  else selectByte(problem.detail?.match(/^byte (\d+)/)?.[1]);
}

function select(pointer, focus = true) {
  const range = locate(body.value, pointer);
  if (range) mark(range, focus);
}

/// Where the text stops being JSON; the server counts bytes, from 1.
function selectByte(number) {
  if (!number) return;
  const before = new TextDecoder().decode(new TextEncoder().encode(body.value).slice(0, Math.max(0, number - 1)));
  mark({start: before.length, end: before.length + 1}, true);
}

function mark(range, focus) {
  if (focus) body.focus();
  body.setSelectionRange(range.start, range.end);
  const line = body.value.slice(0, range.start).split('\n').length - 1;
  const lines = body.value.split('\n').length;
  body.scrollTop = Math.max(0, body.scrollHeight * line / lines - body.clientHeight / 2);
}

// One job at a time ---------------------------------------------------------------------------------------------------

function showState(text, percent) {
  by('state').textContent = text;
  by('percent').textContent = percent === undefined ? '' : `${percent.toFixed(1)} %`;
  if (percent !== undefined) bar.value = percent;
}

function setBusy(busy) {
  by('render').disabled = busy;
  by('cancel').disabled = true;  // until there is a job
  by('result').setAttribute('aria-busy', String(busy));
}

async function submit(event) {
  event.preventDefault();
  clearErrors();
  by('stats').hidden = by('download').hidden = picture.hidden = true;
  setBusy(true);
  format = parsed()?.options?.format ?? 'png';
  showState('Sending', 0);
  try {
    if (!by('access').hidden) setKey(by('key').value.trim());
    const answer = await call('/v1/jobs', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: body.value});
    const value = await answer.json().catch(() => ({detail: `${answer.status} ${answer.statusText}`}));
    if (!answer.ok) {
      showProblem(value);
      showState('Not accepted');
      if (answer.status === 401) askForKey();
      setBusy(false);
      return;
    }
    follow(value);
  } catch {
    showState('The server does not answer');
    setBusy(false);
  }
}

function askForKey() {
  by('access').hidden = false;
  by('key').value = key();
  by('key').focus();
}

function follow(resource) {
  job = resource;
  by('cancel').disabled = false;
  showState(job.state === 'running' ? 'Rendering' : 'Queued', job.progress.percent);
  events = followEvents(job.links.events, ['progress', 'succeeded', 'failed', 'canceled'], (name, data) => {
    if (name !== 'progress') return finish();
    const {percent, state, eta_s: eta} = JSON.parse(data);
    const rest = eta == null || percent < 1 ? '' : `, about ${Math.max(1, Math.round(eta))} s left`;
    showState(state === 'queued' ? 'Queued' : `Rendering${rest}`, percent);
  }, streamLost);
  previewTimer = setInterval(showPreview, 1000);
}

// The browser comes back by itself after a cut, but not after a refusal.
async function streamLost(isOver) {
  if (!isOver) return showState('The connection is lost, trying again', bar.value);
  const followed = job.id;
  await new Promise(resolve => setTimeout(resolve, 2000));
  if (job.id !== followed || !by('render').disabled) return;
  const answer = await call(job.links.self).catch(() => null);
  if (answer?.status === 404 || answer?.status === 401 || answer?.status === 403) return giveUp(answer);
  // The stream may be refused for as long as others have theirs: the job tells how it stands.
  const resource = answer?.ok ? await answer.json().catch(() => job) : job;
  if (['succeeded', 'failed', 'canceled'].includes(resource.state)) return finish();
  clearInterval(previewTimer);
  follow(resource);
}

/// For want of an answer, or because of it.
function giveUp(answer) {
  events.close();
  clearInterval(previewTimer);
  previewTimer = 0;
  setBusy(false);
  const texts = {401: 'The server asks for a key', 403: 'The key does not allow this', 404: 'The server no longer knows this job'};
  showState(answer === undefined ? 'The server does not answer' : texts[answer.status] ?? `${answer.status} ${answer.statusText}`);
  if (answer?.status === 401) askForKey();
}

async function showPreview() {
  const image = new Image();
  const followed = job.id;
  const url = await urlOf(`${job.links.preview}?${Date.now()}`).catch(() => null);
  if (!url) return;
  const isWanted = () => previewTimer && job.id === followed;
  image.onload = () => {
    if (isWanted()) showPicture(url, 'The picture so far');
    else if (url.startsWith('blob:')) URL.revokeObjectURL(url);
  };
  image.src = url;
}

function showPicture(url, text) {
  if (picture.src.startsWith('blob:')) URL.revokeObjectURL(picture.src);
  picture.src = url;
  picture.alt = text;
  picture.hidden = false;
}

async function finish() {
  events.close();
  clearInterval(previewTimer);
  previewTimer = 0;
  by('cancel').disabled = true;
  try {
    let answer = await call(job.links.self);
    while (answer.status === 429 || answer.status === 503) {
      const pause = Number(answer.headers.get('Retry-After')) || 1;
      await new Promise(resolve => setTimeout(resolve, 1000 * pause));
      answer = await call(job.links.self);
    }
    if (!answer.ok) return giveUp(answer);
    job = await answer.json();
  } catch {
    return giveUp();
  }
  setBusy(false);
  if (job.state === 'succeeded') {
    showState('Done', 100);
    const url = await urlOf(job.links.image).catch(() => job.links.image);
    // No browser shows OpenEXR: the preview is the same picture as a PNG.
    const shown = format === 'exr' ? await urlOf(job.links.preview).catch(() => job.links.preview) : url;
    showPicture(shown, 'The rendered scene');
    const last = by('download').href;
    if (last.startsWith('blob:')) URL.revokeObjectURL(last);
    by('download').href = url;
    by('download').download = `penumbra.${format}`;
    by('download').hidden = false;
    showStats(job.stats);
  } else if (job.state === 'failed') {
    showState('Failed', job.progress.percent);
    showProblem(job.error ?? {detail: 'The render failed'});
  } else {
    showState('Canceled', job.progress.percent);
  }
}

function showStats({build_s, render_s, encode_s, rays, estimated_error}) {
  const duration = seconds => seconds < 1 ? `${(1000 * seconds).toFixed(seconds < 0.01 ? 1 : 0)} ms` : `${seconds.toFixed(1)} s`;
  const count = number => number.toLocaleString('en');
  const rows = {
    'Build': duration(build_s), 'Render': duration(render_s), 'Encode': duration(encode_s),
    'Camera rays': count(rays.camera), 'Shadow rays': count(rays.shadow), 'Reflected rays': count(rays.reflection),
    'Transmitted rays': count(rays.transmission), 'Estimated error': estimated_error?.toExponential(1) ?? '–',
  };
  by('stats').replaceChildren(...Object.entries(rows).map(([name, value]) => {
    const row = document.createElement('div'), term = document.createElement('dt'), text = document.createElement('dd');
    term.textContent = name;
    text.textContent = value;
    row.append(term, text);
    return row;
  }));
  by('stats').hidden = false;
}

by('job').addEventListener('submit', submit);
by('cancel').addEventListener('click', async () => {
  const answer = await call(job.links.cancel, {method: 'POST'}).catch(() => null);
  // One that has ended meanwhile says so in its events.
  if (!answer?.ok && answer?.status !== 409) showState('The server did not take the cancel', bar.value);
});
by('example').addEventListener('change', openExample);
body.addEventListener('input', () => { showOptions(); clearErrors(); });
for (const name of optionFields) by(name).addEventListener('change', writeOption);
loadExamples().catch(() => showState('The examples could not be loaded'));
