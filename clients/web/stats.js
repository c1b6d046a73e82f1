// The figures of a finished job.
import {by, element} from './page.js';

const duration = seconds => seconds < 1 ? `${(1000 * seconds).toFixed(seconds < 0.01 ? 1 : 0)} ms` : `${seconds.toFixed(1)} s`;
const count = number => number.toLocaleString('en');

export function showStats({build_s, render_s, encode_s, rays, estimated_error}) {
  const rows = {
    'Build': duration(build_s), 'Render': duration(render_s), 'Encode': duration(encode_s),
    'Camera rays': count(rays.camera), 'Shadow rays': count(rays.shadow), 'Reflected rays': count(rays.reflection),
    'Transmitted rays': count(rays.transmission), 'Estimated error': estimated_error?.toLocaleString('en', {maximumSignificantDigits: 2}) ?? '–',
  };
  by('stats').replaceChildren(...Object.entries(rows).map(([name, value]) =>
    element('div', {}, element('dt', {textContent: name}), element('dd', {textContent: value}))));
  by('stats').hidden = false;
}
