// Real servers and a real browser, and what every test does with the page.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {mkdirSync, mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {createInterface} from 'node:readline';
import {test, before, after} from 'node:test';
import {chromium} from 'playwright-core';

export const bin = process.argv[2];
export const pictures = join(bin, '..', 'web-test');
const folder = mkdtempSync(join(tmpdir(), 'penumbra-'));
const flags = ['--no-sandbox', '--disable-gpu', '--no-first-run', '--disable-background-networking',
               '--disable-component-update', '--disable-sync', '--disable-quic'];
export const wide = {width: 1440, height: 900}, narrow = {width: 360, height: 760};
export let server, browser;

/// A path for a file or folder that lives as long as the tests.
let files = 0;
export const temporary = () => join(folder, `${++files}`);

/// `penumbra serve` with more flags: its address, and a way to end it.
export async function start(more = [], listen = '127.0.0.1:0') {
  const process = spawn(join(bin, 'penumbra'), ['serve', '--listen', listen, '--log-level', 'off', ...more], {stdio: ['ignore', 'pipe', 'inherit']});
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
  server = await start(['--store', temporary()]);
  browser = await chromium.launch({executablePath: '/usr/bin/chromium', args: flags});
});

after(async () => {
  await browser?.close();
  await server?.stop();
  rmSync(folder, {recursive: true});
});

/// A test with a page of a browser that has never been here; what the browser complains about fails it. `url` is the
/// server's that all tests share, `options` are the browser context's.
export function testPage(name, run, {url = () => server.url, ...options} = {}) {
  test(name, async () => {
    const context = await browser.newContext({viewport: wide, ...options});
    const page = await context.newPage();
    const complaints = [];
    page.on('pageerror', error => complaints.push(String(error)));
    // A refusal is an answer the browser reports by its status.
    page.on('console', message => message.type() === 'error' && !/Failed to load resource/.test(message.text()) && complaints.push(message.text()));
    try {
      if (url) await visit(page, url());
      await run(page, context);
      assert.deepEqual(complaints, []);
    } finally {
      await context.close();
    }
  });
}

export async function visit(page, url) {
  await page.goto(url);
  await until(page, () => document.querySelector('#example').options.length > 1 && document.querySelector('#state').textContent !== '');
  await until(page, async () => (await import('./editor.js')).text() !== '');
}

/// Waits until the function, run in the page, says so. (The page's own policy forbids the library's way, which is eval.)
export async function until(page, condition, argument) {
  for (const end = Date.now() + 180000; Date.now() < end; await new Promise(resolve => setTimeout(resolve, 20))) {
    if (await page.evaluate(condition, argument)) return;
  }
  assert.fail(`never came true: ${condition} ${JSON.stringify(argument ?? '')}; the page says ${await page.textContent('#state')}`);
}

export const state = (page, expected) => until(page, s => document.querySelector('#state').textContent.startsWith(s), expected);

export const textOf = page => page.evaluate(async () => (await import('./editor.js')).text());
export const jobOf = async page => JSON.parse(await textOf(page));

/// The whole text, as if somebody had pasted it.
export async function write(page, text) {
  await page.click('#text');
  await page.keyboard.press('Control+A');
  await page.keyboard.insertText(text);
}

/// Types at the end of the text.
export async function type(page, text) {
  await page.click('#text');
  await page.keyboard.press('Control+End');
  await page.keyboard.type(text);
}

/// Chooses an example by name and waits for its JSON.
export async function choose(page, name) {
  await page.selectOption('#example', name);
  await until(page, async n => (await import('./editor.js')).text().includes(`"name": "${n}"`), name);
}

export async function setOption(page, name, value) {
  await page.fill(`#${name}`, String(value));
  await page.dispatchEvent(`#${name}`, 'change');
}

/// The page has kept what stands there.
export const untilKept = page => until(page, async () =>
  sessionStorage.getItem(`penumbra ${location.pathname} text`) === (await import('./editor.js')).text());

/// An example that renders in no time, with these options, and no other job's picture will do.
export async function chooseQuick(page, options = {width: 64, height: 48}) {
  await choose(page, 'light-sphere-point');
  for (const [name, value] of Object.entries({...options, shadow_samples: ++quick})) await setOption(page, name, value);
}
let quick = 0;

/// One that takes as long as anybody wants.
export async function chooseSlow(page) {
  await choose(page, 'hard-and-soft');
  for (const [name, value] of [['width', 300], ['height', 200], ['samples_per_pixel', 4000], ['shadow_samples', 4000]]) await setOption(page, name, value);
}

export async function renderQuick(page, options) {
  await chooseQuick(page, options);
  await page.click('#render');
  await state(page, 'Done');
  await until(page, () => document.querySelector('#picture').src.includes('/image') && document.querySelector('#picture').complete);
}

/// What of an element is in view, in pixels of its height.
export const visibleHeight = (page, selector) => page.evaluate(s => {
  const {top, bottom, left, right} = document.querySelector(s).getBoundingClientRect();
  return left >= 0 && right <= innerWidth ? Math.min(bottom, innerHeight) - Math.max(top, 0) : 0;
}, selector);

export const isWhollyVisible = async (page, selector) => {
  const box = await page.locator(selector).boundingBox();
  return box.height > 0 && Math.abs(await visibleHeight(page, selector) - box.height) < 1;
};
