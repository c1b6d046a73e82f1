// Jobs have addresses, and a list.
import assert from 'node:assert/strict';
import {choose, chooseSlow, jobOf, renderQuick, setOption, start, state, temporary, testPage, textOf, type, until, visit} from './harness.js';

testPage('a running job is taken up again from its address, with its scene and options, here and in another browser', async page => {
  await chooseSlow(page);
  await page.click('#render');
  await state(page, 'Rendering');
  const [address, text] = [page.url(), await textOf(page)];
  assert.match(address, /\/#\/jobs\/[0-9A-Z]{26}$/);
  await page.reload();
  await state(page, 'Rendering');
  assert.equal(await textOf(page), text);
  const elsewhere = await page.context().browser().newPage();
  try {
    await elsewhere.goto(address);
    await state(elsewhere, 'Rendering');
    await until(elsewhere, async t => (await import('./editor.js')).text() === t, text);
    assert.equal(await elsewhere.inputValue('#samples_per_pixel'), '4000');
    await elsewhere.click('#cancel');
    await state(elsewhere, 'Canceled');
  } finally {
    await elsewhere.close();
  }
  await state(page, 'Canceled');
});

testPage('a finished job is shown again from its address, with its picture, and going back shows the one before', async page => {
  await renderQuick(page, {width: 64, height: 48});
  const first = page.url();
  await setOption(page, 'width', 72);
  await page.click('#render');
  await until(page, () => document.querySelector('#picture').naturalWidth === 72);
  assert.notEqual(page.url(), first);
  await page.reload();
  await until(page, () => document.querySelector('#picture').naturalWidth === 72);
  await page.goBack();
  await until(page, () => document.querySelector('#picture').naturalWidth === 64);
  await until(page, () => document.querySelector('#width').value === '64');
  assert.equal((await jobOf(page)).options.width, 64);
  assert.ok(await page.isVisible('#download'));
  assert.match(await page.textContent('#stats'), /Camera rays/);
});

testPage('edits made after a job has been sent are still there when it is taken up again', async page => {
  await renderQuick(page);
  await type(page, '\n ');
  const edited = await textOf(page);
  await page.reload();
  await state(page, 'Done');
  assert.equal(await textOf(page), edited);
  assert.ok(await page.isHidden('#replace'), 'they are no edits of another job');
});

testPage('opening another job asks before it drops edits, and shows the job whatever the answer', async page => {
  await renderQuick(page, {width: 64, height: 48});
  const first = new URL(page.url()).hash;
  await renderQuick(page, {width: 65, height: 48});
  await type(page, ' ');
  const edited = await textOf(page);
  await page.click(`#job-list a[href="${first}"]`);
  await page.click('#replace button[value=keep]');
  await until(page, () => document.querySelector('#picture').naturalWidth === 64);
  assert.equal(await textOf(page), edited);
});

testPage('an address of no job says so, and leaves the page usable', async page => {
  await page.evaluate(() => { location.hash = '#/jobs/01JDF3Z4N6Q8R0S2T4V6X8Y0Z2'; });
  await state(page, 'The server no longer knows this job');
  await renderQuick(page);
});

for (const [name, lines] of [['teapot', 100], ['light-sphere-point', 10]]) testPage(`a scene that was sent in one line is set out readably: ${name}`, async page => {
  await choose(page, name);
  const job = await jobOf(page);
  job.options = {width: 40, height: 40};
  const {id} = await page.evaluate(async body => (await fetch('v1/jobs', {method: 'POST', headers: {'Content-Type': 'application/json'}, body})).json(), JSON.stringify(job));
  await page.evaluate(hash => { location.hash = hash; }, `#/jobs/${id}`);
  await state(page, 'Done');
  await until(page, () => document.querySelector('#width').value === '40');
  assert.deepEqual(await jobOf(page), job);
  assert.ok((await textOf(page)).split('\n').length > lines);
});

testPage('a job that has failed says why, also where it is opened from its address', async page => {
  const strict = await start(['--store', temporary(), '--job-time-limit', '1']);
  try {
    await visit(page, strict.url);
    await chooseSlow(page);
    await page.click('#render');
    await state(page, 'Failed');
    const why = await page.textContent('#problem');
    assert.match(why, /took too long/);
    const elsewhere = await page.context().browser().newPage();
    try {
      await elsewhere.goto(page.url());
      await state(elsewhere, 'Failed');
      await until(elsewhere, async text => (await import('./editor.js')).text() === text, await textOf(page));
      await until(elsewhere, text => document.querySelector('#problem').textContent === text, why);
      assert.ok(await elsewhere.isVisible('#errors'));
    } finally {
      await elsewhere.close();
    }
  } finally {
    await strict.stop();
  }
}, {url: null});

testPage('the list tells of each job its picture, name, size, state and time', async page => {
  await renderQuick(page, {width: 64, height: 48});
  const item = page.locator('#job-list li').first();
  await until(page, () => document.querySelector('#job-list li img').naturalWidth === 64);
  assert.equal(await item.locator('.name').textContent(), 'light-sphere-point');
  assert.equal(await item.locator('.size').textContent(), '64 × 48');
  assert.equal(await item.locator('.job-state').textContent(), 'succeeded');
  assert.match(await item.locator('time').textContent(), /just now|ago/);
  assert.ok(Math.abs(new Date(await item.locator('time').getAttribute('datetime')) - Date.now()) < 60000);
  assert.equal(await item.locator('a').getAttribute('aria-current'), 'true');
  await chooseSlow(page);
  await page.click('#render');
  await until(page, () => /^running, \d+ %$/.test(document.querySelector('#job-list li .job-state').textContent));
  assert.equal(await item.locator('.name').textContent(), 'hard-and-soft');
  await page.click('#cancel');
  await until(page, () => document.querySelector('#job-list li .job-state').textContent === 'canceled');
});

testPage('a long list is shown in parts', async page => {
  const other = await start(['--store', temporary()]);
  try {
    await visit(page, other.url);
    await page.waitForSelector('#no-jobs:not([hidden])');
    const make = count => page.evaluate(async n => {
      const {scene} = await (await fetch('scenes/light-sphere-point.json')).json();
      for (let i = 0; i < n; ++i) {
        await fetch('v1/jobs', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify({scene, options: {width: 8, height: 8, seed: i}})});
      }
    }, count);
    await make(15);
    await renderQuick(page);
    await until(page, () => document.querySelectorAll('#job-list li').length === 12);
    await page.click('#more');
    await until(page, () => document.querySelectorAll('#job-list li').length === 16);
    assert.ok(await page.isHidden('#more'));
  } finally {
    await other.stop();
  }
}, {url: null});
