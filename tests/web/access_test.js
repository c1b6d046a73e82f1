// Servers that ask for a key, and servers below a path of a proxy.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {createServer, request} from 'node:http';
import {join} from 'node:path';
import {bin, choose, chooseQuick, chooseSlow, server, setOption, start, state, temporary, testPage, until, visit} from './harness.js';

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

/// What a proxy does with `handle_path /render/*`: passes on what is below, and knows nothing else.
const proxy = createServer((from, to) => {
  if (!from.url.startsWith('/render/')) return to.writeHead(404).end();
  const target = new URL(server.url);
  const passed = request({host: target.hostname, port: target.port, method: from.method, path: from.url.slice('/render'.length), headers: {...from.headers, host: target.host}},
                         answer => answer.pipe(to.writeHead(answer.statusCode, answer.headers)));
  passed.on('error', () => to.destroy());
  to.on('close', () => passed.destroy());
  from.pipe(passed);
});

testPage('below a path of a proxy everything works', async page => {
  await new Promise(resolve => proxy.listen(0, '127.0.0.1', resolve));
  const lost = [];
  page.on('response', answer => answer.status() === 404 && lost.push(answer.url()));
  try {
    await visit(page, `http://127.0.0.1:${proxy.address().port}/render/`);
    await until(page, () => document.querySelector('#picture').naturalWidth > 0);
    await chooseSlow(page);
    await page.click('#render');
    await until(page, () => document.querySelector('#picture').alt === 'The picture so far');
    await page.click('#cancel');
    await state(page, 'Canceled');
    await chooseQuick(page);
    await page.click('#render');
    await state(page, 'Done');
    await page.reload();
    await until(page, () => document.querySelector('#picture').naturalWidth === 64);
    await until(page, () => document.querySelector('#job-list img').naturalWidth > 0);
    const schema = await page.evaluate(async () => (await fetch([...document.links].find(link => link.textContent.startsWith('What a scene')).href)).status);
    assert.equal(schema, 200);
    assert.equal(await page.evaluate(async () => (await fetch(document.querySelector('#download').href)).status), 200);
    assert.deepEqual(lost, []);
  } finally {
    proxy.closeAllConnections?.();
    proxy.close();
  }
}, {url: null});
