#include "engine/shading/light_cells.h"

#include <cmath>

namespace penumbra::shading {
namespace {

constexpr double pixels_per_cell = 20;
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

bool LightCells::locate(const ShadingPoint& at) {
  const accel::Kind kind = world_.items[at.id.item].kind;
  if (kind != accel::Kind::plane && kind != accel::Kind::patch) return false;
  const Vec3& n = at.facing;
  const double width = pixels_per_cell * at.footprint;
  if (!(width > finest * math::max_component(math::abs(position_)) && width < 1e100)) return false;
  const int level = std::ilogb(width);
  spacing_ = std::scalbn(1.0, level);
  const Vec3 size = math::abs(n);
  up_ = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  key_ = {at.id,
          0,
          static_cast<std::int16_t>(level),
          dot(n, at.surface.normal) > 0,
          static_cast<std::int64_t>(std::floor(position_[(up_ + 1) % 3] / spacing_)),
          static_cast<std::int64_t>(std::floor(position_[(up_ + 2) % 3] / spacing_))};
  return true;
}

std::optional<accel::Cell> LightCells::cell(const Vec3& n) const {
  const std::optional<Vec3> origin = point_of_plane(key_.surface, spacing_);
  if (!origin) return std::nullopt;
  const int a = (up_ + 1) % 3, b = (up_ + 2) % 3;
  accel::Cell cell{{}, n};
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3& corner = cell.corners[i];
    corner[a] = static_cast<double>(key_.row + (i == 1 || i == 2 ? 1 : 0)) * spacing_;
    corner[b] = static_cast<double>(key_.column + (i >= 2 ? 1 : 0)) * spacing_;
    corner[up_] = (*origin)[up_] - (n[a] * (corner[a] - (*origin)[a]) + n[b] * (corner[b] - (*origin)[b])) / n[up_];
  }
  return cell;
}

const accel::CellContents* LightCells::find(const ShadingPoint& at, std::size_t light, const accel::Target& target) {
  if (!(at.surface.position == position_ && at.facing == facing_ && at.id == key_.surface)) {
    position_ = at.surface.position, facing_ = at.facing, key_.surface = at.id;
    is_located_ = locate(at);
  }
  if (!is_located_) return nullptr;
  key_.light = static_cast<std::uint32_t>(light);
  if (entries_.empty()) entries_.resize(capacity);
  Entry& entry = entries_[key_.hash() % capacity];
  if (!entry.is_used || !(entry.key == key_)) {
    entry.key = key_, entry.is_used = true;
    const std::optional<accel::Cell> here = cell(at.facing);
    entry.contents = here ? accel::CellContents(world_, *here, target, at.id) : accel::CellContents();
  }
  return &entry.contents;
}

}  // namespace penumbra::shading
