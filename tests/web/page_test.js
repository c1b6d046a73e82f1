// The page, as a person meets it: choose an example, render, watch the percentage, see the picture, make a mistake, cancel.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {mkdirSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {createInterface} from 'node:readline';
import {test, before, after} from 'node:test';
import {chromium} from 'playwright-core';
import {locate} from '../../clients/web/locate.js';

const bin = process.argv[2];
const pictures = join(bin, '..', 'web-test');
const store = mkdtempSync(join(tmpdir(), 'penumbra-'));
const flags = ['--no-sandbox', '--disable-gpu', '--no-first-run', '--disable-background-networking',
               '--disable-component-update', '--disable-sync', '--disable-quic'];
let server, browser, page;
const complaints = [];

/// `penumbra serve` with more flags: its address, and a way to end it.
async function start(more) {
  const process = spawn(join(bin, 'penumbra'), ['serve', '--listen', '127.0.0.1:0', '--log-level', 'off', ...more], {stdio: ['ignore', 'pipe', 'inherit']});
  const gone = new Promise(resolve => process.once('exit', resolve));
  const stop = () => process.kill('SIGTERM') && gone;
  for await (const line of createInterface(process.stdout)) {
    const address = line.match(/^listening on (.*)$/)?.[1];
    if (address) return {url: address, stop};
  }
  assert.fail('no server');
}

before(async () => {
  mkdirSync(pictures, {recursive: true});
  server = await start(['--store', store]);
  browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: flags});
  page = await browser.newPage({viewport: {width: 1280, height: 860}});
  page.on('pageerror', error => complaints.push(String(error)));
  page.on('console', message => message.type() === 'error' && complaints.push(message.text()));
  await page.goto(server.url);
  await until(() => document.querySelector('#body').value !== '');
});

after(async () => {
  await browser?.close();
  await server?.stop();
  rmSync(store, {recursive: true});
});

/// Waits until the function, run in the page, says so. (The page's own policy forbids the library's way, which is eval.)
async function until(condition, argument) {
  for (const end = Date.now() + 60000; Date.now() < end; await new Promise(resolve => setTimeout(resolve, 20))) {
    if (await page.evaluate(condition, argument)) return;
  }
  assert.fail(`never came true: ${condition}`);
}
const text = selector => page.textContent(selector);
const state = expected => until(s => document.querySelector('#state').textContent.startsWith(s), expected);

/// Chooses an example by name and waits for its JSON.
async function choose(name) {
  await page.selectOption('#example', {label: name});
  await until(n => document.querySelector('#body').value.includes(`"name": "${n}"`), name);
}

async function setOption(name, value) {
  await page.fill(`#${name}`, String(value));
  await page.dispatchEvent(`#${name}`, 'change');
}

test('render an example: the percentage rises, previews appear, the picture comes', async () => {
  await choose('room-flat');
  await setOption('width', 700);
  await setOption('height', 700);
  await setOption('samples_per_pixel', 16);
  assert.equal(JSON.parse(await page.inputValue('#body')).options.width, 700);
  await page.evaluate(() => {
    window.seen = [];
    new MutationObserver(() => window.seen.push(parseFloat(document.querySelector('#percent').textContent)))
        .observe(document.querySelector('#percent'), {childList: true, characterData: true, subtree: true});
  });
  await page.click('#render');
  await until(() => document.querySelector('#picture').src.includes('/preview'));
  await page.screenshot({path: join(pictures, 'rendering.png')});
  await state('Done');
  const seen = (await page.evaluate(() => window.seen)).filter(Number.isFinite);
  assert.ok(seen.some(p => p > 0 && p < 100), `percentages between 0 and 100: ${seen}`);
  assert.deepEqual(seen, [...seen].sort((a, b) => a - b), 'the percentage never falls');
  assert.equal(await text('#percent'), '100.0 %');
  await until(() => document.querySelector('#picture').src.endsWith('/image') && document.querySelector('#picture').complete);
  assert.equal(await page.evaluate(() => document.querySelector('#picture').naturalWidth), 700);
  assert.ok(await page.isVisible('#download'));
  assert.match(await text('#stats'), /Camera rays/);
  await page.screenshot({path: join(pictures, 'done.png'), fullPage: true});
});

test('a mistake is shown with its place, and the place is marked in the text', async () => {
  await choose('light-sphere-point');
  const job = JSON.parse(await page.inputValue('#body'));
  job.scene.objects[0].radius = -1;
  job.scene.lights[0].colour = 1;
  job.options = {width: 0};
  await page.fill('#body', JSON.stringify(job, null, 1));
  await page.click('#render');
  await page.waitForSelector('#errors:not([hidden])');
  const errors = await text('#error-list');
  assert.match(errors, /\/scene\/objects\/0\/radius/);
  assert.match(errors, /\/scene\/lights\/0\/colour/);
  await page.click('#error-list button >> text=radius');
  const marked = await page.evaluate(() => {
    const area = document.querySelector('#body');
    return area.value.slice(area.selectionStart, area.selectionEnd);
  });
  assert.equal(marked, '-1');
  assert.equal(await text('#problem'), 'The job is invalid');
  assert.equal(await page.getAttribute('#width', 'aria-invalid'), 'true');
  assert.equal(await page.getAttribute('#height', 'aria-invalid'), null);
  await page.screenshot({path: join(pictures, 'errors.png')});
});

test('text that is not JSON is refused, and marked where it goes wrong', async () => {
  await page.fill('#body', '{"scene": {"name": "Größe", "lights": [}}');
  await page.click('#render');
  await page.waitForSelector('#errors:not([hidden])');
  assert.match(await text('#problem'), /JSON/i);
  const rest = await page.evaluate(() => {
    const area = document.querySelector('#body');
    return area.value.slice(area.selectionStart);
  });
  assert.equal(rest, '}}');
});

test('a stream that is refused is asked for again', async () => {
  await choose('glass-and-mirrors');
  await setOption('samples_per_pixel', 400);
  let asked = 0;
  await page.route('**/events', route => asked++ ? route.continue() : route.fulfill({status: 503}));
  await page.click('#render');
  while (asked < 2) await page.waitForTimeout(100);
  await page.click('#cancel');
  await state('Canceled');
  await page.unroute('**/events');
});

test('the end of a job is seen though its stream is refused for ever', async () => {
  await choose('light-sphere-point');
  await page.route('**/events', route => route.fulfill({status: 429}));
  await page.click('#render');
  await state('Done');
  await page.unroute('**/events');
  assert.ok(await page.isEnabled('#render'));
});

test('a job the server has forgotten leaves the page usable', async () => {
  await choose('light-sphere-point');
  await page.route('**/events', route => route.fulfill({status: 404}));
  await page.route('**/v1/jobs/*', route => route.fulfill({status: 404}));
  await page.click('#render');
  await state('The server no longer knows this job');
  await page.unrouteAll();
  assert.ok(await page.isEnabled('#render'));
});

test('a long job can be canceled', async () => {
  await choose('glass-and-mirrors');
  await setOption('samples_per_pixel', 400);
  await page.click('#render');
  await state('Rendering');
  await page.click('#cancel');
  await state('Canceled');
  assert.ok(await page.isEnabled('#render'));
});

test('an OpenEXR image is shown by its preview, and saved under its own name', async () => {
  await choose('light-sphere-point');
  const job = JSON.parse(await page.inputValue('#body'));
  job.options = {...job.options, width: 64, height: 48, format: 'exr'};
  await page.fill('#body', JSON.stringify(job));
  await page.click('#render');
  await state('Done');
  await until(() => document.querySelector('#picture').complete && document.querySelector('#picture').naturalWidth === 64);
  assert.match(await page.getAttribute('#picture', 'src'), /\/preview$/);
  assert.equal(await page.getAttribute('#download', 'download'), 'penumbra.exr');
  assert.match(await page.getAttribute('#download', 'href'), /\/image$/);
});

test('an end that may not be asked for yet is asked for again', async () => {
  await choose('light-sphere-point');
  let refused = 0;
  await page.route('**/v1/jobs/*', route => refused++ === 0 ? route.fulfill({status: 429, headers: {'Retry-After': '1'}}) : route.continue());
  await page.click('#render');
  await state('Done');
  await page.unrouteAll();
  assert.ok(refused > 1);
});

test('a server that asks for a key gets it from who has one', async () => {
  const keys = join(store, '..', `${store.split('/').pop()}-keys`);
  const made = spawnSync(join(bin, 'penumbra'), ['key', 'create', '--owner', 'alice', '--keys', keys], {encoding: 'utf8'});
  const open = page;
  const keyed = await start(['--keys', keys, '--store', `${store}-keyed`]);
  try {
    page = await browser.newPage();
    await page.goto(keyed.url);
    await choose('hard-and-soft');
    await setOption('samples_per_pixel', 4);
    await page.click('#render');
    await state('Not accepted');
    await page.waitForSelector('#access:not([hidden])');
    await page.fill('#key', 'rs_wrong');
    await page.click('#render');
    await state('Not accepted');
    await page.fill('#key', made.stdout.trim());
    await page.click('#render');
    await state('Done');
    await until(() => document.querySelector('#picture').src.startsWith('blob:') && document.querySelector('#picture').naturalWidth > 0);
    assert.match(await page.getAttribute('#download', 'href'), /^blob:/);
    await setOption('samples_per_pixel', 400);
    await page.click('#render');
    await state('Rendering');
    await until(() => document.querySelector('#picture').src.startsWith('blob:') && !document.querySelector('#picture').hidden);
    await page.click('#cancel');
    await state('Canceled');
  } finally {
    await page.close();
    page = open;
    await keyed.stop();
    rmSync(keys);
    rmSync(`${store}-keyed`, {recursive: true});
  }
});

test('on a phone nothing is wider than the screen', async () => {
  await page.setViewportSize({width: 390, height: 844});
  await choose('hard-and-soft');
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  await page.screenshot({path: join(pictures, 'phone.png'), fullPage: true});
  await page.emulateMedia({colorScheme: 'dark'});
  await page.screenshot({path: join(pictures, 'phone-dark.png'), fullPage: true});
});

test('the browser had nothing to complain about', () => {
  // A refusal is an answer the browser reports by its status.
  assert.deepEqual(complaints.filter(line => !/status of [45]\d\d/.test(line)), []);
});

test('a JSON Pointer is found in the text', () => {
  const json = '{"a": [1, {"b/c": "x, }"}, [2]], "d~": null}';
  const at = pointer => { const {start, end} = locate(json, pointer); return json.slice(start, end); };
  assert.equal(at(''), json);
  assert.equal(at('/a/1/b~1c'), '"x, }"');
  assert.equal(at('/a/2/0'), '2');
  assert.equal(at('/d~0'), 'null');
  assert.equal(at('/a/1/missing'), '{"b/c": "x, }"}');
  assert.equal(locate('{"a": [1}', '/a/7'), null);
});
