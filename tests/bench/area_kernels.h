#pragma once

namespace penumbra::bench {

/// Plain loops over the rays to an area light, compiled for this machine and with fast floating point; so they share
/// no inline function with the renderer.
struct FloatVec {
  float x, y, z;
};

/// A rectangle with the names of Ureña, Fajardo, King, "An Area-Preserving Parametrization for Spherical Rectangles",
/// EGSR 2013, seen from the origin: edges along ex and ey in the plane at ez.
struct SeenRectangle {
  FloatVec ex, ey, ez;  // ez reaches the plane, the others are unit
  float x0, x1, y0, y1, z0;
  float b0, b1, k, solid_angle;
};

/// A sphere seen from outside it: n towards the center, u and v across, all unit.
struct SeenSphere {
  FloatVec n, u, v;
  float distance, radius, one_minus_cosine;  // of the cone's half angle
};

/// Where rays end, from the origin, and the cosine that each of them weighs.
struct RayLanes {
  float *x, *y, *z, *cosine;
  int count;
};

/// To the points (u[i], v[i]) of the unit square, each shifted around it.
void aim_at(const SeenRectangle& rectangle, const float* u, const float* v, float shift_u, float shift_v,
            const RayLanes& rays);
/// To the points (px[i], py[i]) of the unit disc.
void aim_at(const SeenSphere& sphere, const float* px, const float* py, const RayLanes& rays);
/// |n·l| on the side of `facing`, 0 on the other.
void find_cosines(const FloatVec& facing, const FloatVec& n, const RayLanes& rays);

}  // namespace penumbra::bench
