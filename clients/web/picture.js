// The stage: one picture at a time, which stays until there is another.
import {forget, urlOf} from './calls.js';
import {by} from './page.js';

const picture = by('picture');

export function showPicture(url, text) {
  if (picture.src !== url) forget(picture.src);
  picture.src = url;
  picture.alt = text;
  picture.hidden = false;
  by('caption').textContent = text;
  by('stage').classList.remove('empty');
}

export function clearPicture() {
  forget(picture.src);
  picture.removeAttribute('src');
  picture.hidden = true;
  by('caption').textContent = '';
  by('stage').classList.add('empty');
  hideResult();
}

/// The download and the figures belong to a finished job.
export function hideResult() {
  by('download').hidden = by('stats').hidden = true;
}

/// The picture of a finished job, as long as `isWanted()`.
export async function showResult(job, isWanted) {
  const image = await urlOf(job.links.image);
  // No browser shows OpenEXR: the preview is the same picture as a PNG.
  const shown = job.format === 'exr' ? await urlOf(job.links.preview) : image;
  if (!isWanted()) return [image, shown].forEach(forget);
  showPicture(shown, `${job.name || 'The picture'}, ${job.width} × ${job.height}`);
  const download = by('download');
  if (download.href !== picture.src) forget(download.href);
  download.href = image;
  download.download = `${job.name.replace(/[^\p{L}\p{N}_-]+/gu, '-') || 'penumbra'}.${job.format}`;
  download.hidden = false;
}
