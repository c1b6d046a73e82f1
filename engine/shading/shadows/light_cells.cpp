#include "engine/shading/shadows/light_cells.h"

#include <bit>
#include <cmath>

#include "engine/accel/wide_tree.h"
#include "engine/math/constants.h"

namespace penumbra::shading::shadows {
namespace {

constexpr double pixels_per_square = 26, pixels_per_cube = 10;
constexpr double finest = 0x1p-36;                        // of the coordinates: what a cell must be wider than
constexpr std::uint64_t multiplier = 0x9e3779b97f4a7c15;  // Knuth's multiplicative hashing
constexpr std::size_t few_nodes = 8;                      // of a tree so small that searching it anew costs no more

// Where many lights drive each other's contents out, points do better on their own: when so many contents were asked
// for less than so often each, nothing is looked up for so many times as many questions.
constexpr std::size_t contents_watched = 512, least_use = 4, rest = 32;

constexpr int exponent_bias = 1023;  // of a double
double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + exponent_bias) << 52);
}

constexpr std::size_t most_held = 1 << 18;  // edges, spheres and others: some 45 MB at most

std::size_t size_of(const CellContents& contents) {
  const Outline* outline = contents.outline();
  return contents.others().size() + (outline == nullptr ? 0 : outline->edges.size() + outline->spheres.size());
}

}  // namespace

std::uint64_t LightCells::Key::place_hash() const {
  std::uint64_t h = surface.item;
  for (const auto part : {static_cast<std::uint64_t>(surface.part), static_cast<std::uint64_t>(row),
                          static_cast<std::uint64_t>(column), static_cast<std::uint64_t>(layer)})
    h = (h ^ (h >> 29)) * multiplier + part;
  return h ^ (h >> 32);
}

LightCells::LightCells(const accel::World& world)
    : world_(world), has_round_cells_(world.structure.wide && world.structure.wide->nodes().size() > few_nodes) {
  places_.fill(none);
}

bool LightCells::locate(const ShadingPoint& at) { return locate_flat(at) || locate_round(at); }

bool LightCells::set_level(double width) {
  if (!(width > finest * math::max_component(math::abs(position_)) && width > 1e-100 && width < 1e100)) return false;
  const int exponent = static_cast<int>(std::bit_cast<std::uint64_t>(width) >> 52) - exponent_bias;
  key_.level = static_cast<std::int16_t>(exponent);
  spacing_ = power_of_two(exponent), per_spacing_ = power_of_two(-exponent);
  return true;
}

std::int64_t LightCells::row_of(double coordinate) const {
  const double rows = coordinate * per_spacing_;  // below 1/finest
  const auto row = static_cast<std::int64_t>(rows);
  return row - (rows < static_cast<double>(row) ? 1 : 0);
}

void LightCells::face(const ShadingPoint& at) {
  facing_ = at.facing, surface_ = at.id;
  const accel::Item& item = world_.items[at.id.item];
  is_flat_ = item.kind == accel::Kind::plane || item.kind == accel::Kind::patch;
  if (!is_flat_) return;
  is_facing_normal_ = dot(at.facing, at.surface.normal) > 0;
  const Vec3 size = math::abs(at.facing);
  up_ = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  if (item.kind == accel::Kind::plane) {
    origin_ = world_.planes[item.index].point, extent_ = math::infinity;
  } else {
    const std::uint32_t triangle = item.index + at.id.part;
    origin_ = world_.triangles[triangle].v0;
    extent_ = math::max_component(world_.triangles.bounds_of(triangle).extent());
  }
}

bool LightCells::locate_flat(const ShadingPoint& at) {
  if (!is_flat_ || !set_level(pixels_per_square * at.footprint) || !(extent_ > spacing_)) return false;
  key_.surface = at.id, key_.is_flat = true, key_.is_facing_normal = is_facing_normal_;
  key_.row = row_of(position_[(up_ + 1) % 3]), key_.column = row_of(position_[(up_ + 2) % 3]), key_.layer = 0;
  return true;
}

bool LightCells::locate_round(const ShadingPoint& at) {
  if (!has_round_cells_ || !set_level(pixels_per_cube * at.footprint)) return false;
  key_.surface = {}, key_.is_flat = key_.is_facing_normal = false;
  key_.row = row_of(position_.x), key_.column = row_of(position_.y), key_.layer = row_of(position_.z);
  return true;
}

FlatCell LightCells::flat_cell() const {
  const Vec3& n = facing_;
  const int a = (up_ + 1) % 3, b = (up_ + 2) % 3;
  FlatCell cell{{}, n};
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3& corner = cell.corners[i];
    corner[a] = static_cast<double>(key_.row + (i == 1 || i == 2 ? 1 : 0)) * spacing_;
    corner[b] = static_cast<double>(key_.column + (i >= 2 ? 1 : 0)) * spacing_;
    corner[up_] = origin_[up_] - (n[a] * (corner[a] - origin_[a]) + n[b] * (corner[b] - origin_[b])) / n[up_];
  }
  return cell;
}

RoundCell LightCells::round_cell() const {
  const auto middle = [&](std::int64_t row) { return (static_cast<double>(row) + 0.5) * spacing_; };
  // Half the diagonal, and room for points moved off their surface.
  return {{middle(key_.row), middle(key_.column), middle(key_.layer)}, 0.8661 * spacing_};
}

const CellContents* LightCells::find(const ShadingPoint& at, std::size_t light, const Target& target,
                                     bool has_outline) {
  if (resting_ > 0) return --resting_, nullptr;
  const bool is_same_surface = at.facing == facing_ && at.id == surface_;
  if (!is_same_surface || !(at.surface.position == position_)) {
    if (!is_same_surface) face(at);
    position_ = at.surface.position;
    is_located_ = locate(at);
    if (is_located_) place_hash_ = key_.place_hash();
  }
  if (!is_located_) return nullptr;
  key_.light = static_cast<std::uint32_t>(light), key_.is_outlined = false;
  if (key_.is_flat) {
    const CellContents& verdict = contents(target);
    if (verdict.verdict() != CellContents::Verdict::unknown) return &verdict;
  }
  if (!has_outline) return nullptr;
  key_.is_outlined = true;
  return &contents(target);
}

const CellContents& LightCells::contents(const Target& target) {
  const Key& key = key_;
  ++asked_;
  const std::uint64_t hash =
      (place_hash_ + (std::uint64_t{key.light} << 1 | std::uint64_t{key.is_outlined})) * multiplier;
  std::uint16_t& place = places_[(hash >> 40) % capacity];
  if (place != none && entries_[place].key == key) return entries_[place].contents;
  if (++built_ == contents_watched) {
    if (asked_ < least_use * built_) resting_ = rest * asked_;
    asked_ = built_ = 0;
  }
  if (held_ > most_held) {
    entries_.clear();
    places_.fill(none);
    held_ = 0;
  }
  if (place == none) {
    place = static_cast<std::uint16_t>(entries_.size());
    entries_.emplace_back();
  }
  Entry& entry = entries_[place];
  held_ -= size_of(entry.contents);
  entry.key = key;
  if (!key.is_outlined) {
    entry.contents = CellContents(world_, flat_cell(), target, key.surface);
  } else if (key.is_flat) {
    entry.contents = CellContents::outlined(world_, flat_cell(), target, key.surface);
  } else {
    entry.contents = CellContents::outlined(world_, round_cell(), target);
  }
  held_ += size_of(entry.contents);
  return entry.contents;
}

}  // namespace penumbra::shading::shadows
