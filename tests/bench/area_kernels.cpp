#include "tests/bench/area_kernels.h"

#include <cmath>

namespace penumbra::bench {
namespace {

float wrapped(float share) { return share >= 1 ? share - 1 : share; }
float clamped(float value, float least, float most) { return value < least ? least : value > most ? most : value; }

}  // namespace

void aim_at(const SeenRectangle& rectangle, const float* u, const float* v, float shift_u, float shift_v,
            const RayLanes& rays) {
  const auto [ex, ey, ez, x0, x1, y0, y1, z0, b0, b1, k, solid_angle] = rectangle;
  constexpr float tiny = 1e-20f, quarter_turn = 1.57079633f;
#pragma GCC ivdep
  for (int i = 0; i < rays.count; ++i) {
    const float au = wrapped(u[i] + shift_u) * solid_angle + k;
    // Two sines: a sine and a cosine of one angle would be a call for each ray, not for eight or sixteen.
    const float fu = (std::sin(au + quarter_turn) * b0 - b1) / std::sin(au);
    const float cu = std::copysign(1 / std::sqrt(fu * fu + b0 * b0), fu), su = 1 - cu * cu;
    const float x = clamped(-(cu * z0) / std::sqrt(su > tiny ? su : tiny), x0, x1);
    const float squared = x * x + z0 * z0;
    const float h0 = y0 / std::sqrt(squared + y0 * y0), h1 = y1 / std::sqrt(squared + y1 * y1);
    const float h = h0 + wrapped(v[i] + shift_v) * (h1 - h0), c = 1 - h * h;
    const float y = clamped(h * std::sqrt(squared / (c > tiny ? c : tiny)), y0, y1);
    rays.x[i] = x * ex.x + y * ey.x + ez.x;
    rays.y[i] = x * ex.y + y * ey.y + ez.y;
    rays.z[i] = x * ex.z + y * ey.z + ez.z;
  }
}

void aim_at(const SeenSphere& sphere, const float* px, const float* py, const RayLanes& rays) {
  const auto [n, u, v, distance, radius, one_minus_cosine] = sphere;
#pragma GCC ivdep
  for (int i = 0; i < rays.count; ++i) {
    // Equal areas of the disc are equal solid angles: 1 − cos goes like the square of the radius.
    const float low = one_minus_cosine * (px[i] * px[i] + py[i] * py[i]);
    const float scale = std::sqrt(one_minus_cosine * (2 - low));
    const float a = px[i] * scale, b = py[i] * scale, c = 1 - low;
    const float squared = radius * radius - distance * distance * (a * a + b * b);
    const float t = distance * c - std::sqrt(squared > 0 ? squared : 0);
    rays.x[i] = t * (n.x * c + u.x * a + v.x * b);
    rays.y[i] = t * (n.y * c + u.y * a + v.y * b);
    rays.z[i] = t * (n.z * c + u.z * a + v.z * b);
  }
}

void find_cosines(const FloatVec& facing, const FloatVec& n, const RayLanes& rays) {
  const auto [x, y, z, cosine, count] = rays;
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const float along = std::fabs(x[i] * n.x + y[i] * n.y + z[i] * n.z);
    const float share = along / std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    cosine[i] = x[i] * facing.x + y[i] * facing.y + z[i] * facing.z > 0 ? share : 0;
  }
}

}  // namespace penumbra::bench
