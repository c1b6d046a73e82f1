#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "engine/accel/binning.h"
#include "engine/accel/wide_tree.h"
#include "engine/math/constants.h"

namespace penumbra::accel {
namespace {

constexpr std::size_t leaf_capacity = WideTree::width;
// What one of the others counts for beside a lane of a block.
constexpr std::size_t weight_of_other = 4;
// Below this level ranges are halved by count, which bounds the depth of any tree (see WideTree::stack_size).
constexpr int depth_of_sah = 48;

/// The middle, axis by axis, of some entries' centers: where most of them are, however far the others.
Vec3 typical_center(const TriangleSet& triangles, std::span<const OtherEntry> others) {
  constexpr std::size_t most = 1023;
  const std::size_t total = triangles.size() + others.size(), step = total / most + 1;
  std::vector<double> centers;
  Vec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    centers.clear();
    for (std::size_t i = 0; i < total; i += step) {
      const math::Bounds box =
          i < triangles.size() ? triangles.bounds_of(static_cast<std::uint32_t>(i)) : others[i - triangles.size()].box;
      centers.push_back(box.center()[axis]);
    }
    const auto half = centers.begin() + static_cast<std::ptrdiff_t>(centers.size() / 2);
    std::nth_element(centers.begin(), half, centers.end());
    middle[axis] = *half;
  }
  return middle;
}

}  // namespace

void run_in_turn(std::int64_t count, const std::function<void(std::int64_t)>& task) {
  for (std::int64_t i = 0; i < count; ++i) task(i);
}

class WideBuilder {
 public:
  WideBuilder(const TriangleSet& triangles, std::span<const OtherEntry> others, const ParallelFor& parallel_for,
              WideTree& tree)
      : triangles_(triangles), others_(others), parallel_for_(parallel_for), tree_(tree) {}

  void build() {
    references_[0] = make_references();
    references_[1].resize(references_[0].size());
    const Part whole{references_[0], extent_of(references_[0])};
    task_size_ = std::max(chunk, whole.range.size() / 32);
    tree_.leaves_.push_back({});
    tree_.root_ = add(whole, 0, tree_, whole.range.size() > 2 * task_size_);
    std::vector<WideTree> built(tasks_.size());
    std::vector<std::uint32_t> roots(tasks_.size());
    parallel_for_(static_cast<std::int64_t>(tasks_.size()), [&](std::int64_t i) {
      const auto k = static_cast<std::size_t>(i);
      built[k].leaves_.push_back({});
      roots[k] = add(tasks_[k].part, tasks_[k].depth, built[k], false);
    });
    references_ = {};
    reserve(built);
    for (std::size_t k = 0; k < tasks_.size(); ++k) {
      tree_.nodes_[tasks_[k].node].child[tasks_[k].lane] = append(std::move(built[k]), roots[k]);
    }
  }

 private:
  struct Part {
    Range range;
    Extent extent;
    bool is_leaf() const { return range.size() + extent.others * (weight_of_other - 1) <= leaf_capacity; }
  };
  struct Task {
    Part part;
    int depth;
    std::size_t node, lane;
  };

  std::vector<Reference> make_references() {
    const std::size_t triangle_count = triangles_.size();
    std::vector<Reference> references(triangle_count + others_.size());
    const auto fill = [&](Reference& r, const math::Bounds& box, std::size_t index, Shape shape) {
      for (int axis = 0; axis < 3; ++axis) {
        r.box.lower[axis] = rounded_down(box.lower[axis] - tree_.origin_[axis]);
        r.box.minus_upper[axis] = -rounded_up(box.upper[axis] - tree_.origin_[axis]);
      }
      r.box.lower[3] = std::bit_cast<float>(static_cast<std::uint32_t>(index));
      r.box.minus_upper[3] = std::bit_cast<float>(static_cast<std::uint32_t>(shape));
    };
    in_chunks(references.size(), parallel_for_, [&](std::size_t, std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) {
        if (i < triangle_count) {
          fill(references[i], triangles_.bounds_of(static_cast<std::uint32_t>(i)), i, Shape::triangle);
        } else {
          const OtherEntry& other = others_[i - triangle_count];
          fill(references[i], other.box, i - triangle_count, other.sphere != nullptr ? Shape::sphere : Shape::other);
        }
      }
    });
    return references;
  }

  /// The sum of find(part of the range) over its parts, on several threads if it pays.
  template <class Find>
  auto sum_over(Range range, const Find& find) const {
    if (range.size() <= std::max(chunk, task_size_)) return find(range);
    std::vector<decltype(find(range))> parts(chunks_of(range.size()));
    in_chunks(range.size(), parallel_for_, [&](std::size_t k, std::size_t from, std::size_t to) {
      parts[k] = find(range.subspan(from, to - from));
    });
    for (std::size_t k = 1; k < parts.size(); ++k) parts.front().include(parts[k]);
    return parts.front();
  }

  Extent extent_of(Range range) const {
    return sum_over(range, [](Range r) { return accel::extent_of(r); });
  }

  std::pair<Part, Part> split(const Part& part, int depth) {
    Range range = part.range;
    std::size_t left_count = 0;
    if (depth < depth_of_sah) {
      const Binning binning(part.extent.centers);
      const Bins bins = sum_over(range, [&](Range r) { return bins_of(r, binning); });
      const Split best = best_split(bins);
      if (best.axis >= 0) {
        Reference* const to = place_beside(range);
        left_count = partition(range, binning, bins, best, to);
        range = {to, range.size()};
      }
    }
    if (left_count == 0) {
      const Box& centers = part.extent.centers;
      const float x = centers.width(0), y = centers.width(1), z = centers.width(2);
      const int axis = x > y ? (x > z ? 0 : 2) : (y > z ? 1 : 2);
      left_count = range.size() / 2;
      std::nth_element(
          range.begin(), range.begin() + static_cast<std::ptrdiff_t>(left_count), range.end(),
          [axis](const Reference& a, const Reference& b) {
            const float ca = a.doubled_center(axis), cb = b.doubled_center(axis);
            return ca != cb ? ca < cb : a.shape() != b.shape() ? a.shape() < b.shape() : a.index() < b.index();
          });
    }
    const Range left = range.first(left_count), right = range.subspan(left_count);
    return {{left, extent_of(left)}, {right, extent_of(right)}};
  }

  /// Where a range may be copied to and from: the same place in the other of two arrays.
  Reference* place_beside(Range range) {
    const auto offset = [&](const std::vector<Reference>& array) {
      return static_cast<std::size_t>(range.data() - array.data());
    };
    const bool is_in_first = std::less_equal<>{}(references_[0].data(), range.data()) &&
                             std::less<>{}(range.data(), references_[0].data() + references_[0].size());
    return is_in_first ? references_[1].data() + offset(references_[0])
                       : references_[0].data() + offset(references_[1]);
  }

  /// Adds the part to `tree` and returns its reference; with `defers`, small parts become tasks.
  std::uint32_t add(const Part& part, int depth, WideTree& tree, bool defers) {
    if (part.is_leaf()) return add_leaf(part.range, tree);
    std::array<Part, WideTree::width> parts{part};
    std::size_t count = 1;
    while (count < WideTree::width) {
      // Open the part a ray is most likely to enter.
      std::size_t largest = count;
      for (std::size_t i = 0; i < count; ++i) {
        if (parts[i].is_leaf()) continue;
        if (largest == count || parts[i].extent.box.half_area() > parts[largest].extent.box.half_area()) largest = i;
      }
      if (largest == count) break;
      std::tie(parts[largest], parts[count]) = split(parts[largest], depth);
      ++count;
    }
    const std::size_t index = tree.nodes_.size();
    tree.nodes_.emplace_back();
    for (std::size_t lane = 0; lane < WideTree::width; ++lane) {
      const bool is_used = lane < count;
      const Box& box = parts[lane].extent.box;
      for (int axis = 0; axis < 3; ++axis) {
        tree.nodes_[index].bounds[axis][lane] = is_used ? box.lower[axis] : math::float_infinity;
        tree.nodes_[index].bounds[axis + 3][lane] = is_used ? -box.minus_upper[axis] : -math::float_infinity;
      }
      std::uint32_t child = WideTree::reference(WideTree::Sort::leaf, 0);
      if (is_used && defers && parts[lane].range.size() <= task_size_) {
        tasks_.push_back({parts[lane], depth + 1, index, lane});
      } else if (is_used) {
        child = add(parts[lane], depth + 1, tree, defers);
      }
      tree.nodes_[index].child[lane] = child;
    }
    return WideTree::reference(WideTree::Sort::node, index);
  }

  std::uint32_t add_leaf(Range range, WideTree& tree) {
    // In a fixed order, whatever the partition left.
    std::sort(range.begin(), range.end(), [](const Reference& a, const Reference& b) {
      return a.shape() != b.shape() ? a.shape() < b.shape() : a.index() < b.index();
    });
    WideTree::Leaf leaf{};
    const auto size = [](const auto& v) { return static_cast<std::uint32_t>(v.size()); };
    leaf.triangle_begin = size(tree.triangle_blocks_), leaf.sphere_begin = size(tree.sphere_blocks_);
    leaf.other_begin = size(tree.others_);
    std::size_t triangle_lane = 0, sphere_lane = 0;
    for (const Reference& r : range) {
      if (r.shape() == Shape::triangle) {
        if (triangle_lane == 0) tree.triangle_blocks_.push_back(empty_triangle_block());
        put(r.index(), triangle_lane, tree.triangle_blocks_.back());
        triangle_lane = (triangle_lane + 1) % WideTree::width;
      } else if (r.shape() == Shape::sphere) {
        if (sphere_lane == 0) tree.sphere_blocks_.push_back(empty_sphere_block());
        put(others_[r.index()], sphere_lane, tree.sphere_blocks_.back());
        sphere_lane = (sphere_lane + 1) % WideTree::width;
      } else {
        tree.others_.push_back(others_[r.index()].item);
      }
    }
    leaf.triangle_end = size(tree.triangle_blocks_), leaf.sphere_end = size(tree.sphere_blocks_);
    leaf.other_end = size(tree.others_);
    const std::uint32_t triangles = leaf.triangle_end - leaf.triangle_begin;
    const std::uint32_t spheres = leaf.sphere_end - leaf.sphere_begin, others = leaf.other_end - leaf.other_begin;
    if (triangles == 1 && spheres + others == 0) {
      return WideTree::reference(WideTree::Sort::triangle_block, leaf.triangle_begin);
    }
    if (spheres == 1 && triangles + others == 0) {
      return WideTree::reference(WideTree::Sort::sphere_block, leaf.sphere_begin);
    }
    tree.leaves_.push_back(leaf);
    return WideTree::reference(WideTree::Sort::leaf, tree.leaves_.size() - 1);
  }

  static WideTree::TriangleBlock empty_triangle_block() {
    WideTree::TriangleBlock block{};
    for (auto& vertex : block.vertex) {
      for (auto& coordinate : vertex) std::fill_n(coordinate, WideTree::width, math::float_nan);
    }
    return block;
  }
  static WideTree::SphereBlock empty_sphere_block() {
    WideTree::SphereBlock block{};
    for (auto& coordinate : block.center) {
      std::fill_n(coordinate, WideTree::width, math::float_nan);
    }
    std::fill_n(block.radius, WideTree::width, math::float_nan);
    return block;
  }
  void put(std::uint32_t triangle, std::size_t lane, WideTree::TriangleBlock& block) const {
    for (std::size_t v = 0; v < 3; ++v) {
      const Vec3 p = triangles_.positions[triangles_.corners[triangle][v]] - tree_.origin_;
      for (int axis = 0; axis < 3; ++axis) block.vertex[v][axis][lane] = static_cast<float>(p[axis]);
    }
    block.triangle[lane] = triangle;
  }
  void put(const OtherEntry& entry, std::size_t lane, WideTree::SphereBlock& block) const {
    const Vec3 center = entry.sphere->center - tree_.origin_;
    for (int axis = 0; axis < 3; ++axis) block.center[axis][lane] = static_cast<float>(center[axis]);
    block.radius[lane] = static_cast<float>(entry.sphere->radius);
    block.item[lane] = entry.item;
  }

  void reserve(const std::vector<WideTree>& parts) {
    const auto make_room = [&](auto member) {
      std::size_t size = (tree_.*member).size();
      for (const WideTree& part : parts) size += (part.*member).size();
      (tree_.*member).reserve(size);
    };
    make_room(&WideTree::nodes_), make_room(&WideTree::triangle_blocks_), make_room(&WideTree::sphere_blocks_);
    make_room(&WideTree::leaves_), make_room(&WideTree::others_);
  }

  /// Moves a task's tree behind the others'; returns where its root came to be.
  std::uint32_t append(WideTree&& part, std::uint32_t root) {
    const std::size_t offset[4]{tree_.nodes_.size(), tree_.triangle_blocks_.size(), tree_.sphere_blocks_.size(),
                                tree_.leaves_.size()};
    const auto other_offset = static_cast<std::uint32_t>(tree_.others_.size());
    const auto moved = [&](std::uint32_t reference) {
      if (reference == WideTree::reference(WideTree::Sort::leaf, 0)) return reference;
      const WideTree::Sort sort = WideTree::sort_of(reference);
      return WideTree::reference(sort, WideTree::index_of(reference) + offset[static_cast<std::size_t>(sort)]);
    };
    for (WideTree::Node& node : part.nodes_) {
      for (std::uint32_t& child : node.child) child = moved(child);
    }
    for (WideTree::Leaf& leaf : part.leaves_) {
      leaf.triangle_begin += static_cast<std::uint32_t>(offset[1]),
          leaf.triangle_end += static_cast<std::uint32_t>(offset[1]);
      leaf.sphere_begin += static_cast<std::uint32_t>(offset[2]),
          leaf.sphere_end += static_cast<std::uint32_t>(offset[2]);
      leaf.other_begin += other_offset, leaf.other_end += other_offset;
    }
    const auto move_to = [](auto& to, auto& from) {
      to.insert(to.end(), from.begin(), from.end());
      from = {};
    };
    move_to(tree_.nodes_, part.nodes_), move_to(tree_.triangle_blocks_, part.triangle_blocks_);
    move_to(tree_.sphere_blocks_, part.sphere_blocks_), move_to(tree_.leaves_, part.leaves_);
    move_to(tree_.others_, part.others_);
    return moved(root);
  }

  const TriangleSet& triangles_;
  std::span<const OtherEntry> others_;
  const ParallelFor& parallel_for_;
  WideTree& tree_;
  std::size_t task_size_ = chunk;
  std::vector<Task> tasks_;
  std::array<std::vector<Reference>, 2> references_;  // each range is in one of them, and may be copied to the other
};

bool WideTree::can_hold(const math::Bounds& bounds) {
  const double size = math::max_component(bounds.extent());
  if (size == 0) return true;
  const double farthest = math::max_component(math::max(math::abs(bounds.lower), math::abs(bounds.upper)));
  return size > 1e-12 && size < 1e15 && farthest < 0x1p24 * size;
}

WideTree::WideTree(const TriangleSet& triangles, std::span<const OtherEntry> others, const ParallelFor& parallel_for) {
  for (const Vec3& p : triangles.positions) bounds_.include(p);
  for (const OtherEntry& other : others) bounds_.include(other.box);
  if (!bounds_.is_empty()) {
    origin_ = typical_center(triangles, others);
    reach_ = math::max_component(math::max(math::abs(bounds_.lower - origin_), math::abs(bounds_.upper - origin_)));
  }
  WideBuilder(triangles, others, parallel_for, *this).build();
}

}  // namespace penumbra::accel
