#include "engine/shading/light_cells.h"

#include <cmath>

namespace penumbra::shading {
namespace {

constexpr double pixels_per_cell = 8;
constexpr double finest = 0x1p-36;  // of the coordinates: what a cell must be wider than

}  // namespace

std::uint64_t LightCells::Key::hash() const {
  std::uint64_t h = surface.item;
  for (const auto part : {static_cast<std::uint64_t>(surface.part), static_cast<std::uint64_t>(light),
                          static_cast<std::uint64_t>(row), static_cast<std::uint64_t>(column)})
    h = (h ^ (h >> 29)) * 0x9e3779b97f4a7c15u + part;  // Knuth's multiplicative hashing
  return (h ^ (h >> 32)) * 0x9e3779b97f4a7c15u >> 40;
}

std::optional<Vec3> LightCells::point_of_plane(const geometry::SurfaceId& surface, double spacing) const {
  const accel::Item& item = world_.items[surface.item];
  if (item.kind == accel::Kind::plane) return world_.planes[item.index].point;
  if (item.kind != accel::Kind::patch) return std::nullopt;
  const std::uint32_t triangle = item.index + surface.part;
  if (!(math::max_component(world_.triangles.bounds_of(triangle).extent()) > spacing)) return std::nullopt;
  return world_.triangles[triangle].v0;
}

const accel::CellContents* LightCells::find(const ShadingPoint& at, std::size_t light, const accel::Target& target) {
  const accel::Kind kind = world_.items[at.id.item].kind;
  if (kind != accel::Kind::plane && kind != accel::Kind::patch) return nullptr;
  const Vec3 &p = at.surface.position, &n = at.facing;
  const double width = pixels_per_cell * at.footprint;
  if (!(width > finest * math::max_component(math::abs(p)) && width < 1e100)) return nullptr;
  const int level = std::ilogb(width);
  const double spacing = std::scalbn(1.0, level);
  const Vec3 size = math::abs(n);
  const int up = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const int a = (up + 1) % 3, b = (up + 2) % 3;
  const double row = std::floor(p[a] / spacing), column = std::floor(p[b] / spacing);
  const Key key{at.id,
                static_cast<std::uint32_t>(light),
                static_cast<std::int16_t>(level),
                dot(n, at.surface.normal) > 0,
                static_cast<std::int64_t>(row),
                static_cast<std::int64_t>(column)};
  if (entries_.empty()) entries_.resize(capacity);
  Entry& entry = entries_[key.hash() % capacity];
  if (!entry.is_used || !(entry.key == key)) {
    entry.key = key, entry.is_used = true, entry.contents = {};
    if (const std::optional<Vec3> origin = point_of_plane(at.id, spacing)) {
      accel::Cell cell{{}, n};
      for (std::size_t i = 0; i < 4; ++i) {
        Vec3& corner = cell.corners[i];
        corner[a] = (row + (i == 1 || i == 2 ? 1 : 0)) * spacing;
        corner[b] = (column + (i >= 2 ? 1 : 0)) * spacing;
        corner[up] = (*origin)[up] - (n[a] * (corner[a] - (*origin)[a]) + n[b] * (corner[b] - (*origin)[b])) / n[up];
      }
      entry.contents = accel::CellContents(world_, cell, target, at.id);
    }
  }
  return &entry.contents;
}

}  // namespace penumbra::shading
