// What is written is not lost, and written fast.
import assert from 'node:assert/strict';
import {choose, chooseQuick, jobOf, renderQuick, setOption, state, testPage, textOf, type, until, untilKept, visit, write} from './harness.js';

testPage('edits survive a reload, a crash of the tab, and are there in the next tab', async (page, context) => {
  await chooseQuick(page, {});
  await type(page, '\n\n  ');
  const edited = await textOf(page);
  // At once: nothing but the reload itself says that it is time to keep them.
  await page.reload();
  await until(page, async text => (await import('./editor.js')).text() === text, edited);
  assert.equal(await page.inputValue('#example'), 'light-sphere-point');
  await type(page, ' ');
  await untilKept(page);
  const last = await textOf(page);
  const other = await context.newPage();
  await visit(other, page.url());
  assert.equal(await textOf(other), last);
});

testPage('two tabs keep each their own', async (page, context) => {
  await type(page, '\n');
  const first = await textOf(page);
  const other = await context.newPage();
  await visit(other, page.url());
  await type(other, '\n\n\n');
  await untilKept(other);
  await page.reload();
  await until(page, async text => (await import('./editor.js')).text() === text, first);
});

testPage('choosing an example asks before it drops edits, and drops none that are kept elsewhere', async page => {
  await chooseQuick(page);
  const edited = await textOf(page);
  await page.selectOption('#example', 'cow');
  await page.waitForSelector('#replace[open]');
  assert.match(await page.textContent('#replace'), /cow/);
  await page.keyboard.press('Escape');
  assert.equal(await textOf(page), edited);
  assert.equal(await page.inputValue('#example'), 'light-sphere-point');
  // Edits that a reload brought back are edits.
  await page.reload();
  await until(page, async text => (await import('./editor.js')).text() === text, edited);
  await page.selectOption('#example', 'cow');
  await page.click('#replace button[value=replace]');
  await until(page, async () => (await import('./editor.js')).text().includes('"name": "cow"'));
  // Even that can be undone.
  await page.click('#text');
  await page.keyboard.press('Control+Z');
  assert.equal(await textOf(page), edited);
  // What a job has been made of, the job has.
  await page.click('#render');
  await state(page, 'Done');
  await choose(page, 'light-triangles-spot');
});

testPage('an option set by a control is one step of undo', async page => {
  await chooseQuick(page, {});
  await type(page, ' ');
  const before = await textOf(page);
  await setOption(page, 'width', 122);
  await setOption(page, 'width', 123);
  await setOption(page, 'height', 77);
  assert.deepEqual([(await jobOf(page)).options.width, (await jobOf(page)).options.height], [123, 77]);
  await page.click('#text');
  await page.keyboard.press('Control+Z');
  await until(page, () => document.querySelector('#height').value === '500');
  assert.deepEqual([(await jobOf(page)).options.width, (await jobOf(page)).options.height], [123, 500]);
  await page.keyboard.press('Control+Z');
  assert.equal((await jobOf(page)).options.width, 122);
  await page.keyboard.press('Control+Z');
  assert.equal(await textOf(page), before);
  await page.keyboard.press('Control+Y');
  assert.equal((await jobOf(page)).options.width, 122);
});

testPage('an option set while the text is no JSON is not lost', async page => {
  await chooseQuick(page, {});
  await type(page, '}');
  await setOption(page, 'width', 222);
  await page.selectOption('#acceleration', 'median');
  await page.waitForSelector('#waiting:not([hidden])');
  // Not even by a reload.
  await page.reload();
  await page.waitForSelector('#waiting:not([hidden])');
  assert.equal(await page.inputValue('#width'), '222');
  await page.click('#text');
  await page.keyboard.press('Control+End');
  await page.keyboard.press('Backspace');
  await until(page, async () => (await import('./editor.js')).text().includes('222'));
  const {options} = await jobOf(page);
  assert.equal(options.width, 222);
  assert.equal(options.acceleration, 'median');
  assert.ok(await page.isHidden('#waiting'));
});

testPage('what is typed in a control and not yet entered survives a reload', async page => {
  await chooseQuick(page, {});
  await page.click('#width');
  await page.keyboard.press('Control+A');
  await page.keyboard.type('321');
  await page.reload();
  await until(page, () => document.querySelector('#width').value === '321');
  assert.equal((await jobOf(page)).options.width, 321);
});

testPage('a browser with no room says so, and asks before it loses edits', async page => {
  await page.evaluate(() => { Storage.prototype.setItem = () => { throw new DOMException('full', 'QuotaExceededError'); }; });
  await type(page, ' ');
  await page.waitForSelector('#not-kept:not([hidden])');
  const asked = [];
  page.once('dialog', dialog => { asked.push(dialog.type()); return dialog.accept(); });
  await page.reload();
  assert.deepEqual(asked, ['beforeunload']);
});

/// The browser's work for a key in the middle of an example, in ms of its main thread's own time, so that a busy machine makes
/// little of a difference; and how long it takes until the frame is painted, the wait for the frame included.
async function typed(page, example) {
  await choose(page, example);
  await page.click('#text');
  await page.keyboard.press('Control+End');
  for (let i = 0; i < 50; ++i) await page.keyboard.press('PageUp');
  // Colors are found out little by little.
  await page.waitForTimeout(3000);
  await page.evaluate(() => {
    window.times = [];
    addEventListener('keydown', () => {
      const begin = performance.now(), channel = new MessageChannel();
      // A message that is sent in a frame's callback arrives when the frame has been laid out and painted.
      channel.port1.onmessage = () => window.times.push(performance.now() - begin);
      requestAnimationFrame(() => channel.port2.postMessage(0));
    }, true);
  });
  const browser = await page.context().newCDPSession(page);
  await browser.send('Performance.enable', {timeDomain: 'threadTicks'});
  const worked = async () => 1000 * (await browser.send('Performance.getMetrics')).metrics.find(({name}) => name === 'TaskDuration').value;
  const work = [];
  for (const key of '1234567890'.repeat(10)) {
    const before = await worked();
    await page.keyboard.press(key);
    await page.waitForTimeout(30);
    work.push(await worked() - before);
  }
  const frames = await page.evaluate(() => window.times);
  const share = (times, s) => times.sort((a, b) => a - b)[Math.floor(s * times.length)];
  const [median, most, frame] = [share(work, 0.5), share(work, 0.95), share(frames, 0.95)];
  console.log(`# a key in ${(await textOf(page)).length} characters: ${median.toFixed(1)} ms of work, 95 % of them at most ${most.toFixed(1)} ms; ` +
              `on the screen after at most ${frame.toFixed(1)} ms`);
  return median;
}

testPage('a key in a scene of 350 kB is as fast as in a small one', async page => {
  const big = await typed(page, 'thousand-spheres');
  assert.ok((await textOf(page)).length > 350000);
  const other = await page.context().browser().newPage({viewport: page.viewportSize()});
  await visit(other, page.url());
  const small = await typed(other, 'light-sphere-point').finally(() => other.close());
  // In a plain <textarea> it is ten times as long.
  assert.ok(big < 3 * small, `${big} ms, and ${small} ms`);
});
