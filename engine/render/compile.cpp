#include "engine/render/compile.h"

#include <algorithm>
#include <limits>

#include "engine/accel/neighbours.h"
#include "engine/accel/normal_cones.h"
#include "engine/accel/tree.h"
#include "engine/accel/wide_tree.h"
#include "engine/geometry/polygon.h"
#include "engine/math/constants.h"
#include "engine/render/compile_lights.h"
#include "engine/shading/light_tree.h"

namespace penumbra::render {
namespace {

/// What so few spheres, cylinders and tubes hide of a light is quickly found.
constexpr std::size_t few_quadrics = 64;

using math::Affine;
using math::Vec3;

shading::CompiledMaterial compiled(const scene::Material& material) {
  shading::CompiledMaterial result{material};
  result.is_lit = !math::is_black(material.diffuse) || !math::is_black(material.specular);
  result.reflects = !math::is_black(material.reflection);
  result.transmits = !math::is_black(material.transmission);
  return result;
}

math::Bounds bounds_of(const accel::TriangleSet& triangles, std::span<const accel::OtherEntry> others) {
  math::Bounds box;
  for (const Vec3& position : triangles.positions) box.include(position);
  for (const accel::OtherEntry& other : others) box.include(other.box);
  return box;
}

/// Over triangles and other items; entries of `grouping` count triangles first.
accel::Structure structure_over(const accel::TriangleSet& triangles, std::span<const accel::OtherEntry> others,
                                scene::Acceleration acceleration, const accel::Grouping& grouping,
                                const accel::ParallelFor& parallel_for) {
  if (acceleration == scene::Acceleration::bvh && accel::WideTree::can_hold(bounds_of(triangles, others))) {
    const auto tree = std::make_shared<const accel::WideTree>(triangles, others, parallel_for);
    if (triangles.neighbours.empty()) return {nullptr, tree, nullptr};
    return {nullptr, tree, std::make_shared<const accel::NormalCones>(*tree, triangles, parallel_for)};
  }
  std::vector<accel::TreeEntry> entries;
  entries.reserve(triangles.size() + others.size());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) entries.push_back({triangles.bounds_of(i), i, true});
  for (const accel::OtherEntry& other : others) entries.push_back({other.box, other.item, false});
  return {std::make_shared<const accel::Tree>(acceleration, entries, grouping), nullptr, nullptr};
}

bool is_area(const scene::Light& light) {
  return std::visit([](const auto& l) { return form_of(l) == scene::Form::area; }, light);
}

/// Whether it casts soft shadows.
bool is_soft(const scene::Light& light) {
  return is_area(light) || std::visit([](const auto& l) { return form_of(l) == scene::Form::disc; }, light);
}

/// Whether a tree chooses its own boxes, whatever the objects are.
bool has_own_tree(scene::Acceleration acceleration) {
  return acceleration == scene::Acceleration::median || acceleration == scene::Acceleration::bvh;
}

/// `back` undoes the mesh's transform. Not unit again, so that what is interpolated is the same as of an instance,
/// which is mapped afterwards.
Vec3 mapped_normal(const Vec3& normal, const Affine& back) {
  return normal == Vec3{} ? normal : back.transposed_vector(math::normalize(normal));
}

/// A corner without a normal has its triangle's: beside others that have one it becomes a vertex of its own.
/// `triangles` ends with those of the mesh.
void split_corners_without_normal(const scene::Mesh& mesh, const Affine& back, accel::TriangleSet& triangles) {
  const std::size_t first = triangles.size() - mesh.triangles.size();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto is_without = [&](std::uint32_t vertex) { return triangles.normals[vertex] == Vec3{}; };
    std::array<std::uint32_t, 3>& corners = triangles.corners[first + i];
    const auto count = std::ranges::count_if(corners, is_without);
    if (count == 0 || count == 3) continue;
    const auto& [a, b, c] = mesh.triangles[i];
    const Vec3 normal = math::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
    for (std::uint32_t& corner : corners) {
      if (!is_without(corner)) continue;
      const Vec3 position = triangles.positions[corner];
      triangles.positions.push_back(position);
      triangles.normals.push_back(mapped_normal(normal, back));
      corner = static_cast<std::uint32_t>(triangles.positions.size() - 1);
    }
  }
}

/// Appends the mesh, transformed, to `triangles`.
void append(const scene::Mesh& mesh, const Affine& transform, accel::TriangleSet& triangles) {
  const std::size_t first = triangles.positions.size();
  triangles.positions.insert(triangles.positions.end(), mesh.positions.begin(), mesh.positions.end());
  if (!(transform == Affine{})) {
    for (std::size_t i = first; i < triangles.positions.size(); ++i) {
      triangles.positions[i] = transform.point(triangles.positions[i]);
    }
  }
  const bool is_mirrored = transform.determinant() < 0;
  for (std::array<std::uint32_t, 3> corner : mesh.triangles) {
    if (is_mirrored) std::swap(corner[1], corner[2]);
    for (std::uint32_t& index : corner) index += static_cast<std::uint32_t>(first);
    triangles.corners.push_back(corner);
  }
  if (mesh.normals.empty() && triangles.normals.empty()) return;
  triangles.normals.resize(first);
  const Affine back = math::inverse(transform);
  for (const Vec3& normal : mesh.normals) triangles.normals.push_back(mapped_normal(normal, back));
  triangles.normals.resize(triangles.positions.size());
  if (!mesh.normals.empty()) split_corners_without_normal(mesh, back, triangles);
}

accel::MeshShape compiled(const scene::Mesh& mesh, const Affine& transform, bool has_soft_lights,
                          const CompileSettings& settings) {
  accel::MeshShape shape;
  append(mesh, transform, shape.triangles);
  for (std::uint32_t i = 0; i < shape.triangles.size(); ++i) shape.bounds.include(shape.triangles.bounds_of(i));
  if (has_soft_lights) link_neighbours(shape.triangles, std::vector<std::uint32_t>(shape.triangles.size()));
  // Inside a mesh there is nothing left to box or group by object.
  const bool has_tree = has_own_tree(settings.acceleration);
  shape.structure = structure_over(shape.triangles, {}, has_tree ? settings.acceleration : scene::Acceleration::none,
                                   {}, settings.parallel_for);
  return shape;
}

class Compiler {
 public:
  Compiler(const scene::Description& description, const CompileSettings& settings)
      : description_(description),
        settings_(settings),
        has_soft_lights_(std::ranges::any_of(description.lights, is_soft)) {
    for (const scene::Mesh& mesh : description.meshes)
      world_.meshes.push_back(compiled(mesh, {}, has_soft_lights_, settings));
  }

  void add_objects(shading::Scene& scene) {
    for (const scene::Material& material : description_.materials) materials_.push_back(compiled(material));
    accel::Grouping root = add_all(description_.objects, {});
    if (!world_.triangles.normals.empty()) world_.triangles.normals.resize(world_.triangles.positions.size());
    build_tree(root);
    if (has_soft_lights_) scene.typical_edge = typical_edge();
    scene.has_many_quadrics = world_.spheres.size() + world_.cylinders.size() + world_.tubes.size() > few_quadrics;
    if (std::ranges::any_of(description_.lights, is_area)) scene.extent = extent();
    scene.world = std::move(world_);
    scene.materials = std::move(materials_);
    scene.item_material = std::move(item_material_);
  }

 private:
  accel::Grouping add_all(const std::vector<scene::Object>& objects, const Affine& transform) {
    accel::Grouping grouping;
    for (const scene::Object& object : objects) {
      if (settings_.is_canceled()) break;
      if (const auto* group = std::get_if<scene::Group>(&object.shape)) {
        grouping.groups.push_back(add_all(group->objects, transform * group->transform));
        continue;
      }
      const auto first = static_cast<std::uint32_t>(world_.items.size());
      material_ = static_cast<std::uint32_t>(object.material);
      std::visit([&](const auto& shape) { add(shape, transform); }, object.shape);
      for (auto item = first; item < world_.items.size(); ++item) grouping.entries.push_back(item);
    }
    return grouping;
  }

  void add_item(accel::Kind kind, std::size_t index, std::uint32_t placement = accel::no_placement) {
    const bool is_opaque = !materials_[material_].transmits;
    world_.is_opaque = world_.is_opaque && is_opaque;
    world_.items.push_back({kind, is_opaque, static_cast<std::uint32_t>(index), placement});
    item_material_.push_back(material_);
  }

  std::uint32_t place(const Affine& transform) {
    if (transform == Affine{}) return accel::no_placement;
    world_.placements.push_back({transform, math::inverse(transform)});
    return static_cast<std::uint32_t>(world_.placements.size() - 1);
  }

  void add_triangle(Vec3 a, Vec3 b, Vec3 c, const Affine& transform) {
    if (!(transform == Affine{})) {
      a = transform.point(a), b = transform.point(b), c = transform.point(c);
      if (transform.determinant() < 0) std::swap(b, c);
    }
    note_triangles(nobodys_mesh, world_.triangles.size(), 1);
    const auto first = static_cast<std::uint32_t>(world_.triangles.positions.size());
    world_.triangles.positions.insert(world_.triangles.positions.end(), {a, b, c});
    world_.triangles.corners.push_back({first, first + 1, first + 2});
    add_patch(world_.triangles.size() - 1);
  }

  /// Of the triangles from `first` to the last one.
  void add_patch(std::size_t first) {
    world_.triangle_items.resize(world_.triangles.size(), static_cast<std::uint32_t>(world_.items.size()));
    add_item(accel::Kind::patch, first);
  }

  void add(const scene::Triangle& triangle, const Affine& transform) {
    add_triangle(triangle.vertices[0], triangle.vertices[1], triangle.vertices[2], transform);
  }
  void add(const scene::Polygon& polygon, const Affine& transform) {
    for (const auto& [a, b, c] : geometry::triangulate(polygon.vertices))
      add_triangle(polygon.vertices[a], polygon.vertices[b], polygon.vertices[c], transform);
  }
  void add(const scene::Sphere& sphere, const Affine& transform) {
    world_.spheres.push_back({sphere.center, sphere.radius});
    add_item(accel::Kind::sphere, world_.spheres.size() - 1, place(transform));
  }
  void add(const scene::Plane& plane, const Affine& transform) {
    const Vec3 normal = math::inverse(transform).transposed_vector(math::normalize(plane.normal));
    world_.planes.push_back({transform.point(plane.point), math::normalize(normal)});
    add_item(accel::Kind::plane, world_.planes.size() - 1);
  }
  void add(const scene::Tube& tube, const Affine& transform) {
    world_.tubes.push_back({tube.point, math::normalize(tube.direction), tube.radius});
    add_item(accel::Kind::tube, world_.tubes.size() - 1, place(transform));
  }
  void add(const scene::Cylinder& c, const Affine& transform) {
    world_.cylinders.push_back({c.point, math::normalize(c.direction), c.radius, c.height, c.caps});
    add_item(accel::Kind::cylinder, world_.cylinders.size() - 1, place(transform));
  }
  void add(const scene::Mesh& mesh, const Affine& transform) {
    if (has_own_tree(settings_.acceleration)) {
      const std::size_t first = world_.triangles.size();
      note_triangles(nobodys_mesh, first, mesh.triangles.size());
      append(mesh, transform, world_.triangles);
      return add_patch(first);
    }
    note_triangles(world_.meshes.size(), 0, mesh.triangles.size());
    world_.meshes.push_back(compiled(mesh, transform, has_soft_lights_, settings_));
    add_item(accel::Kind::mesh, world_.meshes.size() - 1);
  }
  void add(const scene::Instance& instance, const Affine& transform) {
    add_item(accel::Kind::mesh, static_cast<std::size_t>(instance.mesh), place(transform * instance.transform));
  }
  void add(const scene::Group&, const Affine&) {}

  void build_tree(accel::Grouping& root) {
    std::vector<accel::OtherEntry> others;
    std::vector<std::uint32_t> entry_of(world_.items.size(), accel::no_placement);
    for (std::uint32_t i = 0; i < world_.items.size(); ++i) {
      const accel::Item& item = world_.items[i];
      if (item.kind == accel::Kind::patch) {
        entry_of[i] = item.index;
        continue;
      }
      const auto box = bounds_of(world_, item);
      if (!box) {
        world_.infinite_items.push_back(i);
      } else if (!box->is_empty()) {
        entry_of[i] = static_cast<std::uint32_t>(world_.triangles.size() + others.size());
        const bool is_sphere = item.kind == accel::Kind::sphere && item.placement == accel::no_placement;
        others.push_back({*box, i, is_sphere ? &world_.spheres[item.index] : nullptr});
      }
    }
    if (settings_.acceleration == scene::Acceleration::groups) renumber(root, entry_of);
    if (has_soft_lights_) link_neighbours(world_.triangles, silhouette_groups());
    world_.structure = structure_over(world_.triangles, others, settings_.acceleration, root, settings_.parallel_for);
  }

  /// Triangles that may share a silhouette: those of one opaque mesh, and all opaque ones that are objects of their
  /// own.
  std::vector<std::uint32_t> silhouette_groups() const {
    std::vector<std::uint32_t> groups(world_.triangles.size(), accel::no_group);
    constexpr std::uint32_t loose = accel::no_group - 1;
    for (std::size_t begin = 0; begin < groups.size();) {
      std::size_t end = begin + 1;
      const std::uint32_t patch = world_.triangle_items[begin];
      while (end < groups.size() && world_.triangle_items[end] == patch) ++end;
      if (world_.items[patch].is_opaque) {
        std::fill(groups.begin() + static_cast<std::ptrdiff_t>(begin),
                  groups.begin() + static_cast<std::ptrdiff_t>(end), end - begin == 1 ? loose : patch);
      }
      begin = end;
    }
    return groups;
  }

  static void renumber(accel::Grouping& grouping, const std::vector<std::uint32_t>& entry_of) {
    std::vector<std::uint32_t> kept;
    for (const std::uint32_t item : grouping.entries) {
      if (entry_of[item] != accel::no_placement) kept.push_back(entry_of[item]);
    }
    grouping.entries = std::move(kept);
    for (accel::Grouping& group : grouping.groups) renumber(group, entry_of);
  }

  void note_triangles(std::size_t mesh, std::size_t first, std::size_t count) {
    if (!runs_.empty() && runs_.back().mesh == mesh && runs_.back().first + runs_.back().count == first) {
      runs_.back().count += count;
    } else {
      runs_.push_back({mesh, first, count});
    }
  }

  /// The median of a thousand edges, evenly spread over the triangles: the same for every acceleration.
  double typical_edge() const {
    std::size_t total = 0;
    for (const Run& run : runs_) total += run.count;
    const std::size_t step = std::max<std::size_t>(1, total / 1000);
    std::vector<double> lengths;
    std::size_t skipped = 0;  // of the run, before the next one that counts
    for (const Run& run : runs_) {
      const accel::TriangleSet& set = run.mesh == nobodys_mesh ? world_.triangles : world_.meshes[run.mesh].triangles;
      std::size_t i = skipped;
      for (; i < run.count; i += step) {
        const auto& [a, b, c] = set.corners[run.first + i];
        lengths.push_back(math::length(set.positions[b] - set.positions[a]));
      }
      skipped = i - run.count;
    }
    if (lengths.empty()) return math::infinity;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    return *middle;
  }

  /// The same for every acceleration, too.
  double extent() const {
    double largest = 0;
    const auto include = [&](const Vec3& p) { largest = std::max(largest, math::max_component(math::abs(p))); };
    for (const Vec3& p : world_.triangles.positions) include(p);
    for (const Run& run : runs_) {
      if (run.mesh == nobodys_mesh) continue;
      for (const Vec3& p : world_.meshes[run.mesh].triangles.positions) include(p);
    }
    for (const accel::Item& item : world_.items) {
      const auto box = item.kind == accel::Kind::patch ? std::nullopt : bounds_of(world_, item);
      if (box && !box->is_empty()) include(box->lower), include(box->upper);
    }
    return largest;
  }

  /// Triangles side by side in World::triangles or in a mesh of World::meshes.
  struct Run {
    std::size_t mesh, first, count;
  };
  static constexpr std::size_t nobodys_mesh = std::numeric_limits<std::size_t>::max();

  const scene::Description& description_;
  const CompileSettings& settings_;
  bool has_soft_lights_;
  std::vector<Run> runs_;  // of triangles that no instances share, in the scene's order
  accel::World world_;
  std::vector<shading::CompiledMaterial> materials_;
  std::vector<std::uint32_t> item_material_;
  std::uint32_t material_ = 0;  // of the object being added
};

}  // namespace

Compiled compile(const scene::Description& description, const CompileSettings& settings) {
  Compiled result;
  Compiler(description, settings).add_objects(result.scene);
  result.scene.lights = compile_lights(description.lights, result.scene.world, settings, result.merged_lights);
  if (result.scene.lights.size() > shading::LightTree::most_without)
    result.scene.light_tree = std::make_shared<const shading::LightTree>(result.scene.lights);
  result.scene.background = description.background;
  result.scene.ambient = description.ambient;
  return result;
}

}  // namespace penumbra::render
