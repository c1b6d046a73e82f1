#include "api/parse_meshes.h"

#include <algorithm>

#include "api/values.h"

namespace penumbra::api {

namespace {

using math::Vec3;

/// A flat list of triples; nothing when it is wrong.
template <class Value, class Read>
std::optional<std::vector<std::array<Value, 3>>> read_triples(const Field& field, const Read& read) {
  if (!field.is_array() || field.value().size() == 0 || field.value().size() % 3 != 0) {
    field.fail("must be an array of numbers whose length is a multiple of 3, and not 0");
    return std::nullopt;
  }
  std::vector<std::array<Value, 3>> triples(field.value().size() / 3);
  std::size_t next = 0;
  bool is_valid = true;
  for_each_element(field, [&](const Field& element) {
    const std::optional<Value> value = read(element);
    is_valid = is_valid && value.has_value();
    triples[next / 3][next % 3] = value.value_or(Value{});
    ++next;
  });
  if (!is_valid || next != field.value().size()) return std::nullopt;
  return triples;
}

std::optional<std::vector<Vec3>> read_vectors(const Field& field, const Range& range) {
  const auto triples = read_triples<double>(field, number_in(range));
  if (!triples) return std::nullopt;
  std::vector<Vec3> vectors(triples->size());
  std::transform(triples->begin(), triples->end(), vectors.begin(), [](const std::array<double, 3>& triple) {
    return Vec3{triple[0], triple[1], triple[2]};
  });
  return vectors;
}

/// With the number of positions unknown, any index may be right.
std::optional<std::vector<std::array<std::uint32_t, 3>>> read_indices(const Field& field,
                                                                      std::optional<std::size_t> positions) {
  const std::uint64_t end = positions.value_or(std::numeric_limits<std::uint32_t>::max());
  return read_triples<std::uint32_t>(field, [end](const Field& element) -> std::optional<std::uint32_t> {
    const auto index = element.is_number() ? element.value().unsigned_integer() : std::nullopt;
    if (index && *index < end) return static_cast<std::uint32_t>(*index);
    element.fail(index ? "must be less than " + std::to_string(end) + ", the number of positions"
                       : "must be an integer of at least 0");
    return std::nullopt;
  });
}

/// Some may be zero: the geometric one stands in for them.
std::vector<Vec3> read_normals(const Field& field, std::optional<std::size_t> positions) {
  std::vector<Vec3> normals = read_vectors(field, any_number).value_or(std::vector<Vec3>{});
  if (!normals.empty() && positions && normals.size() != *positions) {
    field.fail("must have as many numbers as positions: " + std::to_string(3 * *positions));
  }
  return normals;
}

}  // namespace

scene::Mesh read_mesh(Members& members) {
  scene::Mesh mesh;
  auto positions = members.required("positions", [](const Field& f) { return read_vectors(f, coordinate); });
  const auto count = positions ? std::optional(positions->size()) : std::nullopt;
  auto triangles = members.required("indices", [count](const Field& indices) { return read_indices(indices, count); });
  if (const std::optional<Field> normals = members.optional("normals")) mesh.normals = read_normals(*normals, count);
  if (positions) mesh.positions = std::move(*positions);
  if (triangles) mesh.triangles = std::move(*triangles);
  return mesh;
}

void Meshes::add(std::string_view name, const Field& field) {
  Members members(field);
  named_.emplace(name, scene::MeshId{static_cast<std::uint32_t>(meshes_.size())});
  meshes_.push_back(read_mesh(members));
  reaches_.push_back(api::reach_of(meshes_.back().positions));
  members.refuse_unknown();
}

Reach Meshes::reach_of(scene::MeshId mesh) const {
  const auto index = static_cast<std::size_t>(mesh);
  return index < reaches_.size() ? reaches_[index] : Reach{};  // the use of an unknown name was reported
}

std::optional<scene::MeshId> Meshes::read_use(const Field& field) const {
  const std::optional<std::string_view> name = read_string(field);
  if (!name) return std::nullopt;
  if (const auto found = named_.find(*name); found != named_.end()) return found->second;
  field.fail("no mesh has the name " + quoted(*name));
  return std::nullopt;
}

}  // namespace penumbra::api
