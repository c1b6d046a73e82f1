// The page, as a person meets it: choose an example, render, watch the percentage, see the picture, make a mistake, cancel.
import assert from 'node:assert/strict';
import {readdirSync} from 'node:fs';
import {join} from 'node:path';
import {choose, chooseQuick, chooseSlow, jobOf, pictures, renderQuick, setOption, state, testPage, textOf, until, write} from './harness.js';

testPage('the first load shows the example’s picture, and makes no job', async page => {
  await until(page, () => document.querySelector('#picture').naturalWidth > 0);
  assert.match(await page.getAttribute('#picture', 'src'), /scenes\/hard-and-soft\.png$/);
  assert.ok(await page.isVisible('#picture'));
  await choose(page, 'teapot');
  await until(page, () => document.querySelector('#picture').src.endsWith('/scenes/teapot.png') && document.querySelector('#picture').complete);
});

testPage('every example has a picture, and it is what the example looks like', async page => {
  const differences = await page.evaluate(async () => {
    const edge = 24;
    const small = async blob => {
      const canvas = Object.assign(document.createElement('canvas'), {width: edge, height: edge}), context = canvas.getContext('2d');
      context.imageSmoothingQuality = 'high';
      context.drawImage(await createImageBitmap(blob, {resizeWidth: edge, resizeHeight: edge, resizeQuality: 'high'}), 0, 0);
      return context.getImageData(0, 0, edge, edge).data;
    };
    const found = {};
    for (const {name, path, picture} of await (await fetch('scenes/index.json')).json()) {
      const job = await (await fetch(path)).json();
      Object.assign(job.options, {height: Math.round(96 * job.options.height / job.options.width), width: 96, samples_per_pixel: 4, shadow_samples: 16});
      const rendered = await fetch('v1/render', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(job)});
      const [a, b] = [await small(await rendered.blob()), picture ? await small(await (await fetch(picture)).blob()) : []];
      found[name] = a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length;
    }
    return found;
  });
  assert.equal(Object.keys(differences).length, readdirSync(new URL('../../clients/scenes', import.meta.url)).filter(name => name.endsWith('.json')).length);
  for (const [name, difference] of Object.entries(differences)) assert.ok(difference < 5, `${name}: ${difference} of 255; clients/scenes/pictures/make renders them`);
});

testPage('render an example: the percentage rises, in the title too, previews appear, the picture comes', async page => {
  await choose(page, 'room-flat');
  for (const [name, value] of [['width', 480], ['height', 480], ['samples_per_pixel', 48]]) await setOption(page, name, value);
  assert.equal((await jobOf(page)).options.width, 480);
  await page.evaluate(() => {
    window.seen = [];
    window.titles = new Set();
    new MutationObserver(() => {
      window.seen.push(parseFloat(document.querySelector('#percent').textContent));
      window.titles.add(document.title);
    }).observe(document.querySelector('#percent'), {childList: true, characterData: true, subtree: true});
  });
  await page.click('#render');
  await until(page, () => document.querySelector('#picture').alt === 'The picture so far' && document.querySelector('#picture').complete);
  await page.screenshot({path: join(pictures, 'rendering.png')});
  await state(page, 'Done');
  const seen = (await page.evaluate(() => window.seen)).filter(Number.isFinite);
  assert.ok(seen.some(p => p > 0 && p < 100), `percentages between 0 and 100: ${seen}`);
  assert.deepEqual(seen, [...seen].sort((a, b) => a - b), 'the percentage never falls');
  assert.equal(await page.textContent('#percent'), '100.0 %');
  const titles = await page.evaluate(async () => { await 0; return [...window.titles, document.title]; });
  assert.ok(titles.some(title => /^[1-9]\d? % · room-flat – Penumbra$/.test(title)), titles.join());
  assert.equal(titles.at(-1), 'Done · room-flat – Penumbra');
  await until(page, () => document.querySelector('#picture').src.endsWith('/image') && document.querySelector('#picture').complete);
  assert.equal(await page.evaluate(() => document.querySelector('#picture').naturalWidth), 480);
  assert.ok(await page.isVisible('#download'));
  assert.equal(await page.getAttribute('#download', 'download'), 'room-flat.png');
  assert.match(await page.textContent('#stats'), /Camera rays\d[\d,]*Shadow.*Estimated error0\.\d/, 'numbers as people write them');
  await page.screenshot({path: join(pictures, 'done.png'), fullPage: true});
});

testPage('a mistake is shown with its place, which is marked in the text and stays so until the next render', async page => {
  await chooseQuick(page);
  const job = await jobOf(page);
  job.scene.objects[0].radius = -1;
  job.scene.lights[0].colour = 1;
  job.options = {width: 0};
  await write(page, JSON.stringify(job, null, 1));
  await page.click('#render');
  await page.waitForSelector('#errors:not([hidden])');
  const errors = await page.textContent('#error-list');
  assert.match(errors, /\/scene\/objects\/0\/radius/);
  assert.match(errors, /\/scene\/lights\/0\/colour/);
  assert.equal(await page.textContent('#problem'), 'The job is invalid');
  assert.equal(await page.getAttribute('#width', 'aria-invalid'), 'true');
  assert.equal(await page.getAttribute('#height', 'aria-invalid'), null);
  await page.screenshot({path: join(pictures, 'errors.png')});
  // One is mended: the others are still told, and found though they have moved.
  await setOption(page, 'width', 64000);
  for (const [field, value] of [['colour', '1'], ['radius', '-1']]) {
    await page.click(`#error-list button >> text=${field}`);
    assert.equal(await page.evaluate(async () => (await import('./editor.js')).selected()), value);
  }
  assert.equal(await page.getAttribute('#width', 'aria-invalid'), null);
});

testPage('text that is not JSON is refused, and marked where it goes wrong', async page => {
  await write(page, '{"scene": {"name": "Größe", "lights": [}}');
  await page.click('#render');
  await page.waitForSelector('#errors:not([hidden])');
  assert.match(await page.textContent('#problem'), /JSON/i);
  const [before, marked] = await page.evaluate(async () => {
    const {selected, text} = await import('./editor.js');
    return [text(), selected()];
  });
  assert.equal(marked, '}', before);
});

testPage('a refused render keeps the last picture and its download', async page => {
  await renderQuick(page);
  const address = await page.getAttribute('#picture', 'src');
  await write(page, (await textOf(page)).replace('"radius": ', '"radius": -'));
  await page.click('#render');
  await page.waitForSelector('#errors:not([hidden])');
  assert.equal(await page.getAttribute('#picture', 'src'), address);
  assert.ok(await page.isVisible('#picture'));
  assert.ok(await page.isVisible('#download'));
  assert.ok(await page.isEnabled('#render'));
});

testPage('a long job can be canceled', async page => {
  await chooseSlow(page);
  await page.click('#render');
  await state(page, 'Rendering');
  await page.click('#cancel');
  await state(page, 'Canceled');
  assert.ok(await page.isEnabled('#render'));
  assert.ok(await page.isDisabled('#cancel'));
});

testPage('an OpenEXR image is shown by its preview, and saved under its own name', async page => {
  await chooseQuick(page);
  const job = await jobOf(page);
  job.options = {...job.options, format: 'exr'};
  await write(page, JSON.stringify(job));
  await page.click('#render');
  await state(page, 'Done');
  await until(page, () => document.querySelector('#picture').complete && document.querySelector('#picture').naturalWidth === 64);
  assert.match(await page.getAttribute('#picture', 'src'), /\/preview$/);
  assert.equal(await page.getAttribute('#download', 'download'), 'light-sphere-point.exr');
  assert.match(await page.getAttribute('#download', 'href'), /\/image$/);
});

testPage('Ctrl+Enter renders, from the text and from a control that is being typed in', async page => {
  await chooseQuick(page);
  const before = await textOf(page);
  await page.click('#text');
  await page.keyboard.press('Control+Enter');
  assert.equal(await textOf(page), before, 'the text is as it was');
  await state(page, 'Done');
  await page.fill('#width', '80');
  await page.press('#width', 'Control+Enter');
  await until(page, () => document.querySelector('#picture').naturalWidth === 80);
});
