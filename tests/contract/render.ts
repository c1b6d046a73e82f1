// Submits a job, follows it and fetches its image with the generated client. The server's address is the argument.
import type {JobRequest} from './client';
import {cancelJob, createJob, getJob, getJobImage, getJobScene, listJobs, render} from './client';
import {client} from './client/client.gen';

declare const process: {argv: string[]};

function check(holds: unknown, what: string): asserts holds {
  if (!holds) throw new Error(what);
}

const body: JobRequest = {
  scene: {
    camera: {position: [0, 2, 8], look_at: [0, 1, 0], vertical_fov: 35},
    objects: [{type: 'sphere', center: [0, 1, 0], radius: 1, material: {diffuse: [0.8, 0.2, 0.1]}}],
    lights: [{type: 'point', position: [4, 6, 5], intensity: 1, radius: 0.8}],
  },
  options: {width: 64, height: 48},
};
const isPng = async (image: Blob | File) => String.fromCharCode(...new Uint8Array(await image.arrayBuffer()).slice(0, 4)) === '\x89PNG';

async function main() {
  client.setConfig({baseUrl: process.argv[2]});
  const checked = await createJob({body, query: {validate_only: true}});
  check(checked.data && 'valid' in checked.data && checked.data.cost.pixels === 64 * 48, 'the body is not valid');

  const made = await createJob({body});
  check(made.data && 'id' in made.data, `no job: ${JSON.stringify(made.error)}`);
  const path = {id: made.data.id};
  let job = made.data;
  while (job.state === 'queued' || job.state === 'running') {
    await new Promise(resolve => setTimeout(resolve, 50));
    const read = await getJob({path});
    check(read.data, `the job is gone: ${JSON.stringify(read.error)}`);
    job = read.data;
  }
  check(job.state === 'succeeded' && job.stats && job.stats.rays.camera > 0, `the job has ${job.state}`);
  const image = await getJobImage({path});
  check(image.data && await isPng(image.data), 'the image is no PNG');
  const scene = await getJobScene({path});
  check(scene.data?.options?.width === 64, 'the scene is another one');
  const list = await listJobs({query: {state: 'succeeded'}});
  check(list.data?.jobs.some(one => one.id === path.id), 'the job is not listed');
  const waited = await render({body});
  check(waited.data && await isPng(waited.data), 'the rendered image is no PNG');

  const over = await cancelJob({path});
  check(over.error?.type === '/problems/job-ended' && over.response.status === 409, 'a job that has ended was canceled');
  const wrong = await createJob({body: {...body, options: {width: 0}}});
  check(wrong.error?.errors?.[0]?.pointer === '/options/width', 'the place of the fault is not told');
}

void main();
