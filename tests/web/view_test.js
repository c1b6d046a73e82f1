// What is in view, on a phone and on a desk.
import assert from 'node:assert/strict';
import {join} from 'node:path';
import {chooseQuick, chooseSlow, isWhollyVisible, jobOf, narrow, pictures, renderQuick, state, testPage, textOf, type, until, visibleHeight, wide, write} from './harness.js';

for (const [name, viewport] of Object.entries({narrow, wide})) {
  testPage(`status and errors are in view where it is ${name}`, async page => {
    await chooseSlow(page);
    for (const selector of ['#text', '#width', '#jobs-title']) {
      await page.locator(selector).scrollIntoViewIfNeeded();
      for (const part of ['#state', '#bar', '#render', '#cancel']) assert.ok(await isWhollyVisible(page, part), `${part} beside ${selector}`);
    }
    await page.click('#render');
    await state(page, 'Rendering');
    await page.click('#cancel');
    await state(page, 'Canceled');
    for (const part of ['#state', '#percent']) assert.ok(await isWhollyVisible(page, part), part);
    // Many errors at once, from wherever one is.
    const job = await jobOf(page);
    for (const object of job.scene.objects) object.colour = 1;
    await write(page, JSON.stringify(job, null, 1));
    await page.locator('#jobs-title').scrollIntoViewIfNeeded();
    await page.keyboard.press('Control+Enter');
    await page.waitForSelector('#errors:not([hidden])');
    await until(page, () => document.querySelector('#problem').getBoundingClientRect().bottom < innerHeight);
    assert.ok(await isWhollyVisible(page, '#problem'));
    assert.ok(await visibleHeight(page, '#errors') >= 60, 'at least an error is seen');
    const [errors, status] = await Promise.all(['#problem', '#status'].map(part => page.locator(part).boundingBox()));
    assert.ok(errors.y + errors.height <= status.y || status.y + status.height <= errors.y || errors.x + errors.width <= status.x, 'nothing covers the problem');
    assert.ok(await isWhollyVisible(page, '#state'));
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'nothing is wider than the screen');
  }, {viewport});
}

for (const [name, viewport] of Object.entries({narrow, wide})) {
  testPage(`a name of one long word stays where it belongs where it is ${name}`, async page => {
    await chooseQuick(page);
    const job = await jobOf(page), long = 'Donaudampfschifffahrt'.repeat(12);
    job.scene.name = long;
    await write(page, JSON.stringify(job));
    await page.click('#render');
    await state(page, 'Done');
    await until(page, text => document.querySelector('#caption').textContent.startsWith(text), long);
    await until(page, text => document.querySelector('#job-list .name')?.textContent === text, long);
    const isInside = () => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth && [...document.querySelectorAll('main > *, dialog')]
        .every(part => part.scrollWidth <= part.clientWidth));
    assert.ok(await isInside(), 'the page');
    const {hash} = new URL(page.url());
    await chooseQuick(page);
    await type(page, ' ');
    await page.click(`#job-list a[href="${hash}"]`);
    await page.waitForSelector('#replace[open]');
    assert.ok(await isInside(), 'the question');
  }, {viewport});

  testPage(`the whole of a problem is seen, and where the keyboard is, where it is ${name}`, async page => {
    await write(page, '{"scene": {"name": "Größe", "lights": [}}');
    const ring = await page.evaluate(() => getComputedStyle(document.querySelector('#text')).outlineStyle);
    assert.equal(ring, 'solid');
    await page.click('#render');
    await page.waitForSelector('#errors:not([hidden])');
    await page.evaluate(() => new Promise(resolve => requestAnimationFrame(() => requestAnimationFrame(resolve))));
    const [errors, status] = await Promise.all(['#errors', '#status'].map(part => page.locator(part).boundingBox()));
    assert.ok(await isWhollyVisible(page, '#errors'));
    assert.ok(errors.y + errors.height <= status.y || errors.x + errors.width <= status.x, 'nothing covers it');
  }, {viewport});
}

testPage('errors stay in their panel where the window is low', async page => {
  await write(page, '{"scene": {"name": "Größe", "lights": [}}');
  await page.click('#render');
  await page.waitForSelector('#errors:not([hidden])');
  const [panel, errors, jobs] = await Promise.all(['#job', '#errors', '#jobs'].map(part => page.locator(part).boundingBox()));
  assert.ok(errors.y + errors.height <= panel.y + panel.height, 'their panel');
  assert.ok(panel.y + panel.height <= jobs.y, 'the list is below');
  assert.equal(await page.evaluate(() => document.querySelector('#errors').scrollHeight - document.querySelector('#errors').clientHeight), 0, 'all is said');
}, {viewport: {width: 900, height: 600}});

for (const colorScheme of ['light', 'dark']) {
  testPage(`what is written can be read where it is ${colorScheme}`, async page => {
    await renderQuick(page);
    await write(page, (await textOf(page)).replace('"radius": ', '"radius": -'));
    await page.click('#render');
    await page.waitForSelector('#errors:not([hidden])');
    await page.click('#text');
    await page.keyboard.press('Control+F');
    // WCAG 2.1, 1.4.3: the contrast of text is 4.5 at least. And none is tiny.
    const unreadable = await page.evaluate(() => {
      const rgb = text => text.match(/[\d.]+/g).map(Number);
      const luminance = ([r, g, b]) => [r, g, b].map(c => c / 255).map(c => c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
          .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
      const groundOf = node => {
        for (let at = node; at; at = at.parentElement ?? at.getRootNode().host) {
          const color = rgb(getComputedStyle(at).backgroundColor);
          if (color[3] !== 0) return color;
        }
        return [255, 255, 255];
      };
      const found = [];
      const walk = root => {
        for (const node of root.querySelectorAll('*')) {
          if (node.shadowRoot) walk(node.shadowRoot);
          const hasText = [...node.childNodes].some(child => child.nodeType === 3 && child.data.trim());
          if (!hasText || node.disabled || !node.checkVisibility() || ['OPTION', 'SCRIPT', 'STYLE'].includes(node.tagName)) continue;
          if (parseFloat(getComputedStyle(node).fontSize) < 12) found.push(`${node.tagName} ${node.className} ${node.textContent.slice(0, 20)}: small`);
          const [a, b] = [luminance(rgb(getComputedStyle(node).color)), luminance(groundOf(node))].sort((x, y) => y - x);
          if ((a + 0.05) / (b + 0.05) < 4.5) found.push(`${node.tagName} ${node.className} ${node.textContent.slice(0, 20)}: ${((a + 0.05) / (b + 0.05)).toFixed(1)}`);
        }
      };
      walk(document);
      return found;
    });
    assert.deepEqual(unreadable, []);
    assert.ok(await page.evaluate(() => document.querySelector('#text').shadowRoot.querySelector('.cm-search')), 'the search is one of them');
    await page.keyboard.press('Escape');
    await page.setViewportSize(narrow);
    await page.screenshot({path: join(pictures, `phone-${colorScheme}.png`), fullPage: true});
  }, {colorScheme});
}
