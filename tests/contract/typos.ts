// What a compiler is to tell by the types of a generated client: the line under each @ts-expect-error must not compile, the others must.
import type {Camera, JobRequest, Job, Light, Material, Problem, RenderOptions, SceneObject} from './client';

// Objects
export const sphere: SceneObject = {type: 'sphere', center: [0, 0, 0], radius: 1};
// @ts-expect-error the radius is missing
export const withoutRadius: SceneObject = {type: 'sphere', center: [0, 0, 0]};
// @ts-expect-error the radius is no number
export const radiusOfText: SceneObject = {type: 'sphere', center: [0, 0, 0], radius: '1'};
// @ts-expect-error the type is misspelled
export const misspelled: SceneObject = {type: 'spere', center: [0, 0, 0], radius: 1};
// @ts-expect-error the type is missing
export const withoutType: SceneObject = {center: [0, 0, 0], radius: 1};
// @ts-expect-error another spelling of center
export const centre: SceneObject = {type: 'sphere', centre: [0, 0, 0], radius: 1};
// @ts-expect-error an unknown member
export const colour: SceneObject = {type: 'sphere', center: [0, 0, 0], radius: 1, colour: 1};
// @ts-expect-error a member of another type
export const tall: SceneObject = {type: 'sphere', center: [0, 0, 0], radius: 1, height: 2};
export const plane: SceneObject = {type: 'plane', point: [0, 0, 0], normal: [0, 1, 0]};
// @ts-expect-error the normal is missing
export const withoutNormal: SceneObject = {type: 'plane', point: [0, 0, 0]};
export const cylinder: SceneObject = {type: 'cylinder', point: [0, 0, 0], direction: [0, 1, 0], radius: 1, height: 2, caps: false};
// @ts-expect-error caps is no number
export const caps: SceneObject = {type: 'cylinder', point: [0, 0, 0], direction: [0, 1, 0], radius: 1, height: 2, caps: 0};
export const group: SceneObject = {type: 'group', objects: [sphere, {type: 'group', objects: [plane]}]};
// @ts-expect-error a group has no material
export const groupOfMaterial: SceneObject = {type: 'group', objects: [sphere], material: 'red'};
// @ts-expect-error a typo in a group in a group
export const deep: SceneObject = {type: 'group', objects: [{type: 'group', objects: [{type: 'spere', center: [0, 0, 0], radius: 1}]}]};

// Materials
export const material: Material = {diffuse: [0.8, 0.2, 0.1], specular: 0.4, shininess: 60};
export const byName: SceneObject = {type: 'sphere', center: [0, 0, 0], radius: 1, material: 'red'};
// @ts-expect-error an unknown member
export const difuse: Material = {difuse: 0.8};
// @ts-expect-error a color is no text
export const textColor: Material = {diffuse: '#ff0000'};
// @ts-expect-error a typo in an object's own material
export const difuseInside: SceneObject = {type: 'sphere', center: [0, 0, 0], radius: 1, material: {difuse: 0.8}};

// Lights
export const point: Light = {type: 'point', position: [4, 6, 5], intensity: 1, radius: 0.8};
// @ts-expect-error the position is missing
export const nowhere: Light = {type: 'point', intensity: 1};
// @ts-expect-error only a spot has a cutoff
export const cutoff: Light = {type: 'point', position: [4, 6, 5], intensity: 1, cutoff: 20};
export const spot: Light = {type: 'spot', position: [4, 6, 5], direction: [0, -1, 0], intensity: [1, 1, 1], cutoff: 20, exponent: 2};
// @ts-expect-error the type is misspelled
export const directed: Light = {type: 'direction', direction: [0, -1, 0], intensity: 1};
export const rectangle: Light = {type: 'rectangle', corner: [0, 0, 0], edge_u: [1, 0, 0], edge_v: [0, 1, 0], intensity: 1};
// @ts-expect-error an edge is missing
export const oneEdge: Light = {type: 'rectangle', corner: [0, 0, 0], edge_u: [1, 0, 0], intensity: 1};

// Cameras
export const camera: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], vertical_fov: 35};
export const byPlane: Camera = {position: [0, 2, 8], direction: [0, 0, -1], view_plane: {width: 4, height: 3, distance: 5}};
export const orthographic: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], projection: 'orthographic', view_plane: {width: 4, height: 3}};
// @ts-expect-error both look_at and direction
export const twoAims: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], direction: [0, 0, -1], vertical_fov: 35};
// @ts-expect-error neither look_at nor direction
export const aimless: Camera = {position: [0, 2, 8], vertical_fov: 35};
// @ts-expect-error both vertical_fov and view_plane
export const twoViews: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], vertical_fov: 35, view_plane: {width: 4, height: 3, distance: 5}};
// @ts-expect-error neither vertical_fov nor view_plane
export const viewless: Camera = {position: [0, 2, 8], look_at: [0, 1, 0]};
// @ts-expect-error in perspective a view_plane has a distance
export const planeWithoutDistance: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], view_plane: {width: 4, height: 3}};
// @ts-expect-error an orthographic camera has no vertical_fov
export const orthographicAngle: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], projection: 'orthographic', vertical_fov: 35};
// @ts-expect-error no such projection
export const fisheye: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], projection: 'fisheye', vertical_fov: 35};
// @ts-expect-error an unknown member
export const fov: Camera = {position: [0, 2, 8], look_at: [0, 1, 0], vertical_fov: 35, fov: 35};

// Options and the whole
export const options: RenderOptions = {width: 640, height: 480, shadow_samples: 64, acceleration: 'bvh', format: 'png', bit_depth: 16};
// @ts-expect-error an unknown option
export const samples: RenderOptions = {samples: 4};
// @ts-expect-error no such format
export const jpg: RenderOptions = {format: 'jpg'};
// @ts-expect-error no such depth
export const depth: RenderOptions = {bit_depth: 12};
// @ts-expect-error the width is no text
export const wide: RenderOptions = {width: '640'};
export const job: JobRequest = {scene: {camera, objects: [sphere], lights: [point]}, options};
// @ts-expect-error the scene is missing
export const withoutScene: JobRequest = {options};
// @ts-expect-error the camera is missing
export const withoutCamera: JobRequest = {scene: {objects: [sphere]}};
// @ts-expect-error an unknown member
export const object: JobRequest = {scene: {camera, object: [sphere]}};

// Answers
export const isDone = (job: Job) => job.state === 'succeeded';
// @ts-expect-error no such state
export const isFinished = (job: Job) => job.state === 'finished';
export const places = (problem: Problem) => problem.errors?.map(error => `${error.pointer}: ${error.detail}`);
// @ts-expect-error no such member
export const message = (problem: Problem) => problem.message;
