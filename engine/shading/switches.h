#pragma once

namespace penumbra::shading {

/// Parts of shading that save time, or error for the same time, each of which may be switched off. Without
/// `camera_bundles`, `hidden_spheres`, `shadow_bundles`, `lights_without_share` or `light_tree` (if no error is asked
/// for), and without `light_cells` where no light is an area light and no error is asked for, the image is the same bit
/// by bit; else within its estimated error.
struct Switches {
  bool camera_bundles = true;     // camera rays side by side are followed together to what they meet
  bool shadow_candidates = true;  // one query of a light's whole cone instead of a ray per sample
  bool shadow_outlines = true;    // the share of a disc that occluders hide from their outlines, not from samples
  bool few_rays = true;           // where few samples are asked for, rays of many points in bundles, and nothing else
  bool agreeing_rays = true;      // a few rays of points side by side that all agree speak for the rest of them
  bool shared_samples = true;     // what points side by side see of a light tells more of what each sees
  bool shadow_bundles = true;     // rays to one disc share their way through the structure
  bool hidden_spheres = true;     // spheres that larger ones hide from a point cover nothing more of a light
  bool exact_area_lights = true;  // a closed form where an area light is in full view
  bool light_cells = true;        // points side by side share what may hide a light
  bool lights_without_share = true;  // no shadow is looked for where a light adds nothing
  bool light_tree = true;    // of many lights, those that add nothing to a square of pixels are skipped together
  bool drawn_lights = true;  // with an error asked for, a few of the faint lights of the tree stand for the rest
};

}  // namespace penumbra::shading
