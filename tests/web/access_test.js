// Servers that ask for a key.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {join} from 'node:path';
import {bin, chooseQuick, chooseSlow, start, state, temporary, testPage, until, visit} from './harness.js';

const keys = temporary();
let keyed;

function newKey(...more) {
  const made = spawnSync(join(bin, 'penumbra'), ['key', 'create', '--owner', 'alice', '--keys', keys, ...more], {encoding: 'utf8'});
  assert.equal(made.status, 0, made.stderr);
  return made.stdout.trim();
}

async function enter(page, key) {
  await page.fill('#key', key);
  await page.click('text=Use this key');
}

const reason = (page, words) => until(page, w => document.querySelector('#access-reason').textContent.includes(w), words);

testPage('a server that asks for a key gets it from who has one, and asks in words', async page => {
  const key = newKey(), reader = newKey('--scopes', 'jobs:read');
  keyed = await start(['--keys', keys, '--store', temporary()]);
  try {
    await visit(page, keyed.url);
    await page.waitForSelector('#access:not([hidden])');
    await reason(page, 'Whoever runs it gives you one');
    await chooseQuick(page);
    await page.click('#render');
    await state(page, 'Not accepted');
    assert.equal(await page.evaluate(() => document.activeElement.id), 'key');
    await enter(page, 'rs_…');
    await reason(page, 'not a key');
    await enter(page, 'rs_wrong');
    await reason(page, 'does not know this key');
    await enter(page, reader);
    await reason(page, 'may look at jobs');
    // What was refused is done without being asked for again.
    await enter(page, key);
    await state(page, 'Done');
    assert.ok(await page.isHidden('#access'));
    await until(page, () => document.querySelector('#picture').src.startsWith('blob:') && document.querySelector('#picture').naturalWidth === 64);
    assert.match(await page.getAttribute('#download', 'href'), /^blob:/);
    await until(page, () => document.querySelector('#job-list img').naturalWidth === 64);
    await chooseSlow(page);
    await page.click('#render');
    await until(page, () => document.querySelector('#picture').alt === 'The picture so far');
    await page.reload();
    await state(page, 'Rendering');
    await page.click('#cancel');
    await state(page, 'Canceled');
  } finally {
    await keyed.stop();
  }
}, {url: null});
